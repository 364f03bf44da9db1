"""What every room stands on: errors, arrays, files, threads, compiled kernels."""

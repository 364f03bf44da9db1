"""Foundations of the package: errors, arrays, files, options, shapes, compiled kernels."""

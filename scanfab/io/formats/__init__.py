"""Reader plugins: one module for the files of each program."""

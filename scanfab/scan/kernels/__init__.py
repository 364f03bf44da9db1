"""Numba kernels: numbers and arrays in and out; no options, no defaults, no errors."""

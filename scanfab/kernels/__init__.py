"""Numba kernels: numbers and arrays in and out; no options, no defaults, no errors."""

from importlib import import_module
from pkgutil import iter_modules

from scanfab.kernels.cache import kernel_cache

# Numba settles where a function is kept when it is declared
with kernel_cache():
    for _module in iter_modules(__path__):
        import_module(f"{__name__}.{_module.name}")

"""How kernels are compiled: without the interpreter's lock, and kept on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeVar

import numba
import numpy as np
from llvmlite.binding import get_host_cpu_name

from scanfab.base.kernel_cache import cache_of

# numbers that the compiler's vector instructions take at a time: 256 bits of them, also on
# processors that have wider ones, but for these
LANES = 8 if get_host_cpu_name() in ("znver4", "znver5") else 4

# its types leave out some of its options
njit: Any = numba.njit

# a kernel that gets a plain number from another is compiled once more, for this number alone
ZERO: int = np.int64(0)  # type: ignore[assignment]
ONE: int = np.int64(1)  # type: ignore[assignment]

# what lets the compiler make vector instructions of a loop with sums: any order of the terms
REORDERED = {"reassoc", "contract"}

# an argument that is there or not: for each choice a kernel is compiled with nothing else in it
Flag = Literal[True] | None

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function that is called from Python."""
    return _kept(njit(nogil=True)(function), function)


def inner(**options: Any) -> Callable[[Function], Function]:
    """
    Compile a function that only kernels call.

    Without what Python needs to call it, which would take a sixth of the time to compile it all:
    called from Python it ends the process, so tests call it in a kernel of their own.
    """
    compile_it = njit(nogil=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)
    return lambda function: _kept(compile_it(function), function)


def _kept(compiled: Any, function: Function) -> Function:
    if compiled is not function:  # else Numba is switched off
        compiled._cache = cache_of(function)
    same: Function = compiled
    return same

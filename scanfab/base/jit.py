"""
How kernels are compiled: without the interpreter's lock, and kept on disk for later runs.

Numba's own cache trusts its files: it stops at a file that is cut, and runs code with a wrong byte.
Its files are numbered by an index, so that two processes that save at once can give a form the code
of another. It also looks at the file of a kernel only, and does not see that a kernel in another
file, which this kernel calls, has changed. So each compiled form has a file of its own here, with a
checksum, in a folder that is named by a hash of all kernels.
"""

from __future__ import annotations

import hashlib
import operator
import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal, TypeVar

import llvmlite
import numba
import numpy as np
from llvmlite.binding import get_host_cpu_name
from numba.core import ir, types
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps
from numba.core.untyped_passes import InlineInlinables, IRProcessing
from numba.misc import appdirs

from scanfab.base.files import whole_file

# Numbers that a vector instruction takes: 256 bits, except on these processors, which have wider
# instructions that are fast.
LANES = 8 if get_host_cpu_name() in ("znver4", "znver5") else 4

# its types leave out some of its options
njit: Any = numba.njit

# a kernel that gets a plain number from another is compiled once more, for this number alone
ZERO: int = np.int64(0)  # type: ignore[assignment]
ONE: int = np.int64(1)  # type: ignore[assignment]

# what lets the compiler make vector instructions of a loop with sums: any order of the terms
REORDERED = {"reassoc", "contract"}

# an argument that is True or None: a kernel is compiled for each of the two, without the other code
Flag = Literal[True] | None

Function = TypeVar("Function", bound=Callable[..., Any])

# bytes of a checksum
DIGEST_SIZE = 32
# called before the next kernel is compiled
_announcements: list[Callable[[], object]] = []


@register_pass(mutates_CFG=False, analysis_only=False)  # type: ignore[no-untyped-call]
class _KnownFlags(FunctionPass):
    """
    Decide ``is None`` and ``is not None`` by the types of arguments and of fields of NamedTuples.

    Numba then compiles nothing of the branch that is not taken. By itself it does so only for
    arguments that are None, not for fields.
    """

    _name = "scanfab_known_flags"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        definitions = state.func_ir._definitions
        for block in state.func_ir.blocks.values():
            for line in block.find_insts(ir.Assign):
                asked = line.value
                if not isinstance(asked, ir.Expr) or asked.op != "binop":
                    continue
                if asked.fn not in (operator.is_, operator.is_not):
                    continue
                kind, none = (_type_of(state, one) for one in (asked.lhs, asked.rhs))
                if kind is not None and none is types.none:
                    same = isinstance(kind, types.NoneType)
                    answer = same == (asked.fn is operator.is_)
                    line.value = ir.Const(answer, asked.loc)  # type: ignore[no-untyped-call]
                    names = definitions[line.target.name]
                    names[names.index(asked)] = line.value
        return True


def _type_of(state: Any, variable: Any) -> Any:
    """The type of an argument, of a field of an argument, or of None; None if it is unknown."""
    found = guard(get_definition, state.func_ir, variable)  # type: ignore[no-untyped-call]
    if isinstance(found, ir.Arg):
        return state.args[found.index]
    if isinstance(found, ir.Const) and found.value is None:
        return types.none
    if isinstance(found, ir.Expr) and found.op == "getattr":
        whole = _type_of(state, found.value)
        if isinstance(whole, types.NamedTuple) and found.attr in whole.fields:
            return whole.types[whole.fields.index(found.attr)]
    return None


class _Compiler(CompilerBase):
    """Numba's own passes, and the pass for flags before branches are pruned."""

    def define_pipelines(self) -> list[Any]:
        define: Any = DefaultPassBuilder.define_nopython_pipeline
        passes = define(self.state)
        passes.add_pass_after(_KnownFlags, IRProcessing)
        # once more for functions that have been inlined
        passes.add_pass_after(_KnownFlags, InlineInlinables)
        passes.finalize()
        return [passes]


class _Part(JITCodeLibrary):
    """The code of a part, which is optimised and becomes machine code with its kernel."""

    @property
    def codegen(self) -> Any:
        return self

    def set_env(self, _name: str, _env: Any) -> None:
        """Set no environment, which only errors and calls of Python need."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


class _PartCompiler(_Compiler):
    """Compiles a part."""

    def define_pipelines(self) -> list[Any]:
        name = self.state.func_id.func_qualname
        self.state.library = _Part(self.state.targetctx.codegen(), name)  # type: ignore[no-untyped-call]
        return super().define_pipelines()


def kernel(
    function: Function, compiler: type[CompilerBase] = _Compiler, **options: Any
) -> Function:
    """Compile a function that is called from Python."""
    compiled: Function = njit(nogil=True, pipeline_class=compiler, **options)(function)
    # a part is kept with its kernel; and Numba may be switched off
    if compiled is not function and compiler is _Compiler:
        compiled._cache = _Cache(function)  # type: ignore[attr-defined]
    return compiled


def inner(**options: Any) -> Callable[[Function], Function]:
    """
    Compile a function that only kernels call, without the code that Python needs to call it.

    That code would take a sixth of the time. A call from Python ends the process, so tests call
    such a function in a kernel of their own.
    """
    return partial(kernel, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)


def part(**options: Any) -> Callable[[Function], Function]:
    """
    Compile a large function that only kernels call, as a part of them.

    Numba optimises every function, with all that it calls, and makes machine code of it, although
    its callers do the same again. Without that a scan compiles in four fifths of the time. A
    function with a loop where time is spent stays as it is: the loop would be slower.
    """
    return inner(compiler=_PartCompiler, **options)


def when_compiling(tell: Callable[[], object]) -> None:
    """Call a function when a kernel is next compiled rather than found; from any thread."""
    _announcements[:] = [tell]


def kernel_files() -> list[Path]:
    """The files of all kernels, and this one, which says how they are compiled."""
    package = Path(__file__).parents[1]
    # packing/search.py finds contacts, scan/kernels/ scans
    return sorted([Path(__file__), *package.glob("*/search.py"), *package.glob("*/kernels/*.py")])


@cache
def kernel_folder() -> tuple[Path | None, str]:
    """The folder of compiled kernels, made if it can be, and why nothing is kept in it."""
    given = os.environ.get("NUMBA_CACHE_DIR")
    base = given or appdirs.user_cache_dir("scanfab", appauthor=False)  # type: ignore[no-untyped-call]
    if base.startswith("~"):
        return None, "there is no home folder"
    sources = hashlib.sha256(f"{sys.version} {llvmlite.__version__}".encode())
    for file in kernel_files():
        sources.update(file.read_bytes())
    folder = Path(base, f"numba-{numba.__version__}-{sources.hexdigest()[:16]}")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        state = folder.stat()
    except OSError as error:
        return None, f"{error.filename}: {error.strerror}"
    # the files are code that will be run: only the user and the system may write them
    if os.name == "posix" and (state.st_uid not in (0, os.getuid()) or state.st_mode & 0o022):
        return None, f"{folder} is not yours, or others can write to it (chmod go-w)"
    return folder, "" if os.access(folder, os.W_OK) else f"{folder} cannot be written to"


class _Cache(NullCache):
    """The compiled forms of one function, as Numba asks for them and hands them over."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.name = f"{function.__module__}.{function.__qualname__}"

    def _file(self, sig: Any, codegen: Any) -> Path:
        """Of the form for these types of arguments and this processor."""
        folder, problem = kernel_folder()
        if folder is None:
            raise OSError(problem)
        form = hashlib.sha256(repr((tuple(sig), codegen.magic_tuple())).encode()).hexdigest()
        return folder / f"{self.name}-{form[:32]}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        with suppress(OSError):
            file = self._file(sig, target_context.codegen())
            stored = file.read_bytes()
            content = stored[DIGEST_SIZE:]
            if stored[:DIGEST_SIZE] == _digest(file, content):
                # all that a stored form needs; refresh() loads what the compiler needs, for 0.2 s
                rtsys.initialize(target_context)
                return CompileResult._rebuild(target_context, *pickle.loads(content))  # type: ignore[no-untyped-call]
        while _announcements:
            _announcements.pop()()
        return None

    def save_overload(self, sig: Any, cres: Any) -> None:
        with suppress(OSError):  # the disk may be full
            file, content = self._file(sig, cres.codegen), dumps(cres._reduce())  # type: ignore[no-untyped-call]
            with whole_file(file) as part:
                part.write_bytes(_digest(file, content) + content)


def _digest(file: Path, content: bytes) -> bytes:
    """The checksum of a form, which is no other's."""
    return hashlib.sha256(file.name.encode() + content).digest()

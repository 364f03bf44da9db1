"""Options: each is declared once for command line, library, manifest, report and docs."""

from __future__ import annotations

import ast
import inspect
import math
import sys
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from functools import cache, partial, wraps
from itertools import pairwise
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, get_type_hints

from scanfab.base.errors import SettingsError
from scanfab.base.spelling import meant

Parse = Callable[[str, Any], Any]
Floats = tuple[float, ...]
Parses = Callable[[str, Any], tuple[Any, ...]]
P = ParamSpec("P")
R = TypeVar("R")

# groups of options, in the order of the help
GROUPS = ("reading", "sample", "window", "scan", "fabric", "output")
# What the command line turns a text into, by the type of the field. Other types stay texts.
KINDS: dict[Any, type] = {
    hint: kind for kind in (int, float, bool, Path) for hint in (kind, kind | None)
}


def unusable(name: str, expected: str, found: object) -> SettingsError:
    """The error for a value that an option does not accept."""
    return SettingsError(f"{name}: expected {expected}, found {found!r}")


@dataclass(frozen=True)
class Option:
    """
    One option: an argument of the library and an option of the command line.

    A field of a dataclass declares an option by :func:`option`; the docstring below the field is
    its help. The help names other options as Python spells them, in backquotes; the command line
    replaces these names by its own spelling: `rv_center` becomes ``--rv-center``.
    """

    name: str
    """Name of the argument in Python."""
    kind: type
    """Type that the command line turns its text into; bool is a switch."""
    help: str
    """What the option decides, for ``--help``, docstrings and reports."""
    group: str = "output"
    """Group of the help, from :data:`GROUPS`."""
    default: Any = None
    """Default value as users would write it."""
    parse: Parse = lambda name, value: value
    """Function of name and value that checks and converts; converted values pass unchanged."""
    form: str = ""
    """
    Form of the value in the help, such as ``auto|cell|FILE``; empty for that of the type.

    Alternatives without capitals are words, which a shell completes. An option without a parser
    accepts nothing but these words.
    """
    words: Iterable[str] | Callable[[], Iterable[str]] = ()
    """Further words that a shell completes."""
    spelling: str = ""
    """Flag of the command line, if it does not follow from the name."""
    several: bool = False
    """Whether the command line accepts the option more than once."""
    first: bool = False
    """Whether it is listed among the few options that most users need."""
    decides: bool = True
    """
    Whether it decides a result.

    If so, manifest and report list it, ``resume`` and ``merge`` ask for the same value, and
    scanfab.toml may hold it.
    """

    @property
    def flag(self) -> str:
        """The option as the command line spells it."""
        return self.spelling or flag_of(self.name)

    @property
    def takes_file(self) -> bool:
        """Whether the name of a file is among the values."""
        return self.kind is Path or self.form.split("|")[-1].startswith(("FILE", "PATH"))


def flag_of(name: str) -> str:
    """
    The flag of an argument; a trailing underscore, which avoids a keyword of Python, is dropped.

    Examples
    --------
    >>> from scanfab.base.option import flag_of
    >>> flag_of("rv_radius"), flag_of("with_")
    ('--rv-radius', '--with')
    """
    return f"--{name.rstrip('_').replace('_', '-')}"


def option(parse: Parse | None = None, *, default: Any = None, **declaration: Any) -> Any:
    """Declare an option as a field of a dataclass, with attributes of :class:`Option`."""
    if parse is None and "|" in declaration.get("form", ""):
        parse = one_of(*declaration["form"].split("|"))
    if parse is not None:
        declaration["parse"] = parse
    return field(default=default, metadata={"default": default, **declaration})


# these declare an option in one group of the help
reading, sample, window, scan, fabric = (partial(option, group=group) for group in GROUPS[:5])
# declares an option that says how a command runs and decides no result
running = partial(option, decides=False)


def options_of(holder: type) -> tuple[Option, ...]:
    """All options that the fields of a dataclass declare; other fields have no metadata."""
    helps: dict[str, str] = {}
    for base in reversed(holder.__mro__[:-1]):
        helps |= _docstrings(base.__module__).get(base.__name__, {})
    kinds = {name: KINDS.get(hint, str) for name, hint in get_type_hints(holder).items()}
    return tuple(
        Option(name=name, **{"kind": kinds[name], "help": helps[name], **declaration})
        for name, declaration in ((one.name, one.metadata) for one in fields(holder))
        if declaration
    )


def fill(holder: Any, options: Mapping[str, Any], elsewhere: Sequence[Option] = ()) -> None:
    """Check options as users write them, and keep what they mean in the fields of a dataclass."""
    declared = options_of(type(holder))
    refuse_unknown(type(holder).__name__, options, [one.name for one in declared], elsewhere)
    for option in declared:
        value = option.parse(option.name, options.get(option.name, option.default))
        object.__setattr__(holder, option.name, value)


@cache
def _docstrings(module: str) -> dict[str, dict[str, str]]:
    """Docstrings below fields, by class and field; Python keeps them only in the source text."""
    return {
        holder.name: {
            ast.unparse(field.target): " ".join(ast.literal_eval(below.value).split())
            for field, below in pairwise(holder.body)
            if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr)
        }
        for holder in ast.parse(inspect.getsource(sys.modules[module])).body
        if isinstance(holder, ast.ClassDef)
    }


def refuse_unknown(
    what: str, given: Iterable[str], known: Sequence[str], elsewhere: Sequence[Option] = ()
) -> None:
    """
    Raise TypeError for a name that is no option; the message suggests the nearest option.

    ``elsewhere`` are the options of ``read_series``, which a user may have given to ``compute``.
    """
    for name in given:
        if name not in known:
            hint = meant(name, known, "option")
            if any(option.name == name for option in elsewhere):
                hint = "it is an option of read_series"
            raise TypeError(f"{what} has no option {name!r}: {hint}")


def takes_options(
    options: Sequence[Option], elsewhere: Sequence[Option] = ()
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """
    Decorate a function whose signature lists options, which is where editors look for them.

    The decorated function refuses unknown names. In its docstring, ``{options}`` is replaced by the
    help of the options, in the order and with the types of the signature.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        parameters = inspect.signature(function).parameters

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            refuse_unknown(function.__name__, kwargs, list(parameters), elsewhere)
            return function(*args, **kwargs)

        helps = {}
        for option in options:
            # a form of a single word, such as FILE, would repeat the type
            written = f" Written as ``{option.form}``." if set("|:,") & set(option.form) else ""
            text = textwrap.fill(option.help + written, 92, break_on_hyphens=False)
            helps[option.name] = f", optional\n{textwrap.indent(text, '    ')}"
        named = [(one.name, one.annotation) for one in parameters.values() if one.name in helps]
        texts = [f"{name} : {annotation}{helps[name]}" for name, annotation in named]
        call.__doc__ = inspect.cleandoc(function.__doc__ or "").replace(
            "{options}", "\n".join(texts)
        )
        return call

    return decorate


def number(expected: str, holds: Callable[[float], bool], kind: type = float) -> Parse:
    """A parser of one number for which a condition holds; NaN must fail every condition."""

    def parse(name: str, value: Any) -> Any:
        with suppress(TypeError, ValueError, OverflowError):
            result = float(value)
            if (kind is float or result.is_integer()) and holds(result):
                # an integer is returned itself, because a float would round a large one
                return value if kind is int and isinstance(value, int) else kind(result)
        raise unusable(name, expected, value)

    return parse


whole = partial(number, kind=int)
"""A parser of one whole number for which a condition holds."""


def numbers(expected: str, holds: Callable[[Floats], bool], kind: type = float) -> Parses:
    """A parser of finite numbers: a sequence, a text with commas or blanks, or one number."""

    def parse(name: str, value: Any) -> tuple[Any, ...]:
        words = value.replace(",", " ").split() if isinstance(value, str) else value
        with suppress(TypeError, ValueError, OverflowError):
            values = tuple(map(float, words if isinstance(words, Iterable) else [words]))
            is_kind = all(one.is_integer() if kind is int else math.isfinite(one) for one in values)
            if is_kind and holds(values):
                return tuple(map(kind, values))
        raise unusable(name, expected, value)

    return parse


def accepted(expected: str, holds: Callable[[Any], bool]) -> Parse:
    """A parser that returns a value as it is, if a condition holds for it."""

    def parse(name: str, value: Any) -> Any:
        if not holds(value):
            raise unusable(name, expected, value)
        return value

    return parse


def one_of(*words: str) -> Parse:
    """A parser that accepts one of the given words."""
    return accepted(f"{', '.join(words[:-1])} or {words[-1]}", lambda value: value in words)


def optional(parse: Parse, word: str | None = None) -> Parse:
    """The same parser, but None and a word such as ``auto`` give None: the user chose no value."""
    words = (None, word)
    return lambda name, value: (
        None if isinstance(value, str | None) and value in words else parse(name, value)
    )

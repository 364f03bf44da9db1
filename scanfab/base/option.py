"""An option, declared once: command line, library, manifest, report and docs derive from it."""

from __future__ import annotations

import ast
import inspect
import math
import sys
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from functools import cache, partial, wraps
from itertools import pairwise
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from scanfab.base.errors import SettingsError

Parse = Callable[[str, Any], Any]
Floats = tuple[float, ...]
P = ParamSpec("P")
R = TypeVar("R")

# in the order of the help
GROUPS = ("reading", "sample", "window", "scan", "fabric", "output")
# what the command line makes of a text, by the type of the field; of all other types a text
KINDS: dict[str, type] = {"int": int, "float": float, "bool": bool, "Path": Path}


def unusable(name: str, expected: str, found: object) -> SettingsError:
    """The error for a value that an option cannot have."""
    return SettingsError(f"{name}: expected {expected}, found {found!r}")


@dataclass(frozen=True)
class Option:
    """
    One option: an argument of the library, and an option of the command line.

    A field of a dataclass declares it by :func:`option`; its help is the docstring below the field.
    The help names other options by their arguments, in backquotes; the command line spells them as
    it does: `rv_center` is ``--rv-center`` there.
    """

    name: str
    """Of the argument."""
    kind: type
    """What the command line makes of its text; bool is a switch."""
    help: str
    """What it decides: in ``--help``, in docstrings and in a report."""
    group: str = "output"
    """One of :data:`GROUPS`."""
    default: Any = None
    """As users write it."""
    parse: Parse = lambda name, value: value
    """Makes what is kept of an option's name and value; it takes what is kept as well."""
    choices: Sequence[str] | Callable[[], Iterable[str]] = ()
    """What a shell offers. Without a parser, no other words will do."""
    also: str = ""
    """What it takes beside its choices, such as FILE: then a shell offers files too."""
    metavar: str = ""
    """The form of its value, where :attr:`form` would say too little."""
    spelling: str = ""
    """On the command line, where it does not follow from the name."""
    several: bool = False
    """Whether the command line takes it more than once."""
    first: bool = False
    """Whether it stands among the few that most need."""
    decides: bool = True
    """Whether it decides a result: then the report lists it, and scanfab.toml may hold it."""

    @property
    def flag(self) -> str:
        """As the command line spells it."""
        return self.spelling or flag_of(self.name)

    @property
    def form(self) -> str:
        """The form of its value, such as ``auto|cell|FILE``; empty if any will do."""
        words = () if callable(self.choices) else (*self.choices, self.also)
        return self.metavar or "|".join(filter(None, words))


def flag_of(name: str) -> str:
    """
    An argument as the command line spells it; an underscore behind keeps it from being a keyword.

    Examples
    --------
    >>> from scanfab.base.option import flag_of
    >>> flag_of("rv_radius"), flag_of("with_")
    ('--rv-radius', '--with')
    """
    return f"--{name.rstrip('_').replace('_', '-')}"


def option(parse: Parse | None = None, **declaration: Any) -> Any:
    """A field of a dataclass that declares an option, by the attributes of :class:`Option`."""
    choices = declaration.get("choices")
    if parse is None and isinstance(choices, tuple):
        parse = one_of(*choices)
    if parse is not None:
        declaration["parse"] = parse
    return field(default=declaration.get("default"), metadata=declaration)


# options of each group of the help
reading, sample, window, scan, fabric = (partial(option, group=group) for group in GROUPS[:5])
# options that say how a command is run, and decide no result
running = partial(option, decides=False)


def options_of(holder: type) -> tuple[Option, ...]:
    """The options that the fields of a dataclass declare."""
    helps: dict[str, str] = {}
    for one in reversed(holder.__mro__[:-1]):
        helps |= _docstrings(one.__module__).get(one.__name__, {})
    kinds = [KINDS.get(str(one.type).removesuffix(" | None"), str) for one in fields(holder)]
    return tuple(
        Option(one.name, kind, helps[one.name], **one.metadata)
        for one, kind in zip(fields(holder), kinds, strict=True)
    )


@cache
def _docstrings(module: str) -> dict[str, dict[str, str]]:
    """The docstrings below the fields of each class of a module, which only the source has."""
    return {
        holder.name: {
            ast.unparse(field.target): " ".join(ast.literal_eval(below.value).split())
            for field, below in pairwise(holder.body)
            if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr)
        }
        for holder in ast.parse(inspect.getsource(sys.modules[module])).body
        if isinstance(holder, ast.ClassDef)
    }


def refuse_unknown(what: str, given: Iterable[str], known: Sequence[str]) -> None:
    """TypeError for a name that is no option; it names the nearest that is one."""
    for name in given:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"
            raise TypeError(f"{what} has no option {name!r}: {hint}")


def takes_options(options: Sequence[Option]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """
    A decorator for functions with options in their signature, where editors look for them.

    The function refuses names that are no options, and in its docstring the help of the options, in
    the order of the signature and with its types, stands in place of ``{options}``.
    """
    declared = {one.name: one for one in options}

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        parameters = inspect.signature(function).parameters

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            refuse_unknown(function.__name__, kwargs, list(parameters))
            return function(*args, **kwargs)

        helps = [
            _documented(declared[name], one.annotation)
            for name, one in parameters.items()
            if name in declared
        ]
        text = inspect.cleandoc(function.__doc__ or "")
        call.__doc__ = text.replace("{options}", "\n".join(helps))
        return call

    return decorate


def _documented(option: Option, annotation: str) -> str:
    """An option as numpydoc writes a parameter."""
    form = option.form
    # a single word such as FILE says no more than the type does
    written = f" Written as ``{form}``." if set("|:,") & set(form) else ""
    text = textwrap.fill(option.help + written, 92, break_on_hyphens=False)
    return f"{option.name} : {annotation}, optional\n{textwrap.indent(text, '    ')}"


def number(expected: str, holds: Callable[[float], bool]) -> Parse:
    """A parser of one number; any other value counts as not-a-number, for which nothing holds."""

    def parse(name: str, value: Any) -> float:
        try:
            found = float(value)
        except (TypeError, ValueError):
            found = math.nan
        if not holds(found):
            raise unusable(name, expected, value)
        return found

    return parse


def whole(expected: str, holds: Callable[[int], bool]) -> Parse:
    """A parser of one whole number."""
    parse_float = number(expected, lambda found: found.is_integer() and holds(int(found)))

    def parse(name: str, value: Any) -> int:
        found = parse_float(name, value)
        # a float would round a large integer
        return value if isinstance(value, int) else int(found)

    return parse


def numbers(expected: str, holds: Callable[[Floats], bool]) -> Callable[[str, Any], Floats]:
    """A parser of several finite numbers, in a text between commas or blanks or in a sequence."""

    def parse(name: str, value: Any) -> tuple[float, ...]:
        words = value.replace(",", " ").split() if isinstance(value, str) else value
        try:
            found = tuple(map(float, words))
        except (TypeError, ValueError):
            found = (math.nan,)
        if not all(map(math.isfinite, found)) or not holds(found):
            raise unusable(name, expected, value)
        return found

    return parse


def one_of(*words: str) -> Parse:
    """A parser of one word of a few."""

    def parse(name: str, value: Any) -> str:
        if value not in words:
            raise unusable(name, f"{', '.join(words[:-1])} or {words[-1]}", value)
        return str(value)

    return parse


def optional(parse: Parse) -> Parse:
    """The same parser for an option that need not be given."""
    return lambda name, value: None if value is None else parse(name, value)

"""An option, declared once: command line, library, manifest, report and docs derive from it."""

from __future__ import annotations

import inspect
import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from scanfab.base.errors import SettingsError

Parse = Callable[[str, Any], Any]
P = ParamSpec("P")
R = TypeVar("R")

# in the order of the help
GROUPS = ("reading", "sample", "window", "scan", "fabric", "output")


def unusable(name: str, expected: str, found: object) -> SettingsError:
    """The error for a value that an option cannot have."""
    return SettingsError(f"{name}: expected {expected}, found {found!r}")


def as_given(name: str, value: Any) -> Any:
    """For values that are checked where they are used."""
    return value


@dataclass(frozen=True)
class Option:
    """
    One option: an argument of the library, and an option of the command line.

    Its texts name other options by their arguments, in backquotes; the command line spells them as
    it does: `rv_center` is ``--rv-center`` there.
    """

    help: str
    """What it decides: of ``--help`` and of docstrings."""
    group: str
    """One of :data:`GROUPS`."""
    default: Any = None
    """As users write it."""
    parse: Parse = as_given
    """From its name and what users write to what is kept; what is kept, it takes as well."""
    name: str = ""
    """Of the argument; that of the field where one declares it."""
    meaning: str = ""
    """In a report, to those who read results; only what decides results has one."""
    takes: str = "str"
    """The types of the argument, in docstrings."""
    kind: type = str
    """What the command line makes of its text; bool is a switch."""
    metavar: str | None = None
    spelling: str = ""
    """On the command line, where it does not follow from the name."""
    several: bool = False
    """Whether the command line takes it more than once."""
    words: int = 1
    """How many words the command line takes."""
    choices: Callable[[], Iterable[str]] = tuple
    """What a shell offers; other words may do as well."""
    files: bool = False
    """Whether a shell offers files too."""
    first: bool = False
    """Whether it stands among the few that most need."""

    @property
    def flag(self) -> str:
        """As the command line spells it."""
        return self.spelling or flag_of(self.name)


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


def option(**declaration: Any) -> Any:
    """A field of a dataclass that declares an option, of the field's name."""
    # a shell is told of options that take a number and nothing else
    number_only = {"int": int, "float": float}.get(declaration.get("takes", ""), str)
    declared = Option(**{"kind": number_only, **declaration})
    return field(default=declared.default, metadata={"option": declared})


def changed(holder: type, name: str, **changes: Any) -> Any:
    """A field that declares an option of another dataclass once more, with some changes."""
    declared = next(one for one in options_of(holder) if one.name == name)
    declared = replace(declared, **changes)
    return field(default=declared.default, metadata={"option": declared})


def options_of(holder: type) -> tuple[Option, ...]:
    """The options that the fields of a dataclass declare."""
    return tuple(replace(one.metadata["option"], name=one.name) for one in fields(holder))


def refuse_unknown(what: str, given: Iterable[str], known: Sequence[str]) -> None:
    """TypeError for a name that is none, with the nearest that is."""
    for name in given:
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"
            raise TypeError(f"{what} has no option {name!r}: {hint}")


def takes_options(options: Sequence[Option]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """
    A decorator for functions with options in their signature.

    It refuses names that are none of them, with the nearest that is one, and puts what the options
    mean, in the order of the signature, in place of ``{options}`` into the docstring.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        known = list(inspect.signature(function).parameters)

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            refuse_unknown(function.__name__, kwargs, known)
            return function(*args, **kwargs)

        text = inspect.cleandoc(function.__doc__ or "")
        places = {name: place for place, name in enumerate(known)}
        ordered = sorted(options, key=lambda option: places.get(option.name, len(places)))
        call.__doc__ = text.replace("{options}", "\n".join(map(_documented, ordered)))
        return call

    return decorate


def _documented(option: Option) -> str:
    """An option as numpydoc has a parameter."""
    form = option.metavar or ""
    # a single word such as FILE says no more than the type does
    written = f" Written as ``{form}``." if set("|:,") & set(form) else ""
    text = textwrap.fill(option.help + written, 92, break_on_hyphens=False)
    return f"{option.name} : {option.takes}, optional\n{textwrap.indent(text, '    ')}"


def number(expected: str, holds: Callable[[float], bool]) -> Parse:
    """Of options that take a number; what is none is not-a-number, for which nothing holds."""

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
    """Of options that take a whole number."""

    def parse(name: str, value: Any) -> int:
        found = number(expected, float.is_integer)(name, value)
        # not by way of a float, which rounds large ones
        exact = value if isinstance(value, int) else int(found)
        if not holds(exact):
            raise unusable(name, expected, value)
        return exact

    return parse


def one_of(*words: str) -> Parse:
    """Of options that take one word of a few."""

    def parse(name: str, value: Any) -> str:
        if value not in words:
            raise unusable(name, f"{', '.join(words[:-1])} or {words[-1]}", value)
        return str(value)

    return parse


def optional(parse: Parse) -> Parse:
    """The same of an option that need not be given."""
    return lambda name, value: None if value is None else parse(name, value)

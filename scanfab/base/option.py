"""An option, declared once: command line, library, manifest, report and docs derive from it."""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from functools import partial, wraps
from itertools import pairwise
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from scanfab.base.errors import SettingsError

Parse = Callable[[str, Any], Any]
P = ParamSpec("P")
R = TypeVar("R")

# in the order of the help
GROUPS = ("reading", "sample", "window", "scan", "fabric", "output")
# what the command line makes of a text, by the type of the field; of all other types a text
KINDS: dict[str, type] = {"int": int, "float": float, "bool": bool, "Path": Path}
# the options of dataclasses that have been asked for them
_known: dict[type, tuple[Option, ...]] = {}


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
    metavar: str | None = None
    """The form of its value; by default the choices."""
    spelling: str = ""
    """On the command line, where it does not follow from the name."""
    several: bool = False
    """Whether the command line takes it more than once."""
    files: bool = False
    """Whether a shell offers files too."""
    first: bool = False
    """Whether it stands among the few that most need."""
    decides: bool = True
    """Whether it decides a result: then the report lists it, and scanfab.toml may hold it."""

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


def option(parse: Parse | None = None, **declaration: Any) -> Any:
    """A field of a dataclass that declares an option, by the attributes of :class:`Option`."""
    choices = declaration.get("choices")
    if parse is not None:
        declaration["parse"] = parse
    elif isinstance(choices, tuple):
        declaration |= {"parse": one_of(*choices), "metavar": "|".join(choices)}
    return field(default=declaration.get("default"), metadata=declaration)


# options of each group of the help
reading, sample, window, scan, fabric = (partial(option, group=group) for group in GROUPS[:5])
# options that say how a command is run, and decide no result
running = partial(option, decides=False)


def changed(holder: type, name: str, **changes: Any) -> Any:
    """A field that declares an option of another dataclass once more, with some changes."""
    (declared,) = (one.metadata for one in fields(holder) if one.name == name)
    return option(**{**declared, **changes})


def options_of(holder: type) -> tuple[Option, ...]:
    """The options that the fields of a dataclass declare."""
    if holder not in _known:
        texts = dict(pair for one in reversed(holder.__mro__) for pair in _docstrings(one))
        kinds = {one.name: str(one.type).removesuffix(" | None") for one in fields(holder)}
        _known[holder] = tuple(
            Option(one.name, KINDS.get(kinds[one.name], str), texts[one.name], **one.metadata)
            for one in fields(holder)
        )
    return _known[holder]


def _docstrings(holder: type) -> Iterable[tuple[str, str]]:
    """The fields of a class, with the docstrings below them, which only its source has."""
    module = inspect.getmodule(holder)
    # to find the lines of one class would take longer than all of the module
    tree = ast.parse("" if module is None or holder is object else inspect.getsource(module))
    classes = (one for one in tree.body if isinstance(one, ast.ClassDef))
    bodies = [one.body for one in classes if one.name == holder.__name__]
    for place, below in (pair for body in bodies for pair in pairwise(body)):
        match place, below:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                yield name, " ".join(text.split())


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

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        parameters = inspect.signature(function).parameters
        declared = {one.name: one for one in options}

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            refuse_unknown(function.__name__, kwargs, list(parameters))
            return function(*args, **kwargs)

        documented = [
            _documented(declared[one.name], one.annotation)
            for one in parameters.values()
            if one.name in declared
        ]
        text = inspect.cleandoc(function.__doc__ or "")
        call.__doc__ = text.replace("{options}", "\n".join(documented))
        return call

    return decorate


def _documented(option: Option, takes: str) -> str:
    """An option as numpydoc has a parameter."""
    form = option.metavar or ""
    # a single word such as FILE says no more than the type does
    written = f" Written as ``{form}``." if set("|:,") & set(form) else ""
    text = textwrap.fill(option.help + written, 92, break_on_hyphens=False)
    return f"{option.name} : {takes}, optional\n{textwrap.indent(text, '    ')}"


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

    def parse(name: str, value: Any) -> int:
        found = number(expected, float.is_integer)(name, value)
        # a float would round a large integer
        exact = value if isinstance(value, int) else int(found)
        if not holds(exact):
            raise unusable(name, expected, value)
        return exact

    return parse


def numbers(expected: str, holds: Callable[[tuple[float, ...]], bool]) -> Parse:
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

"""What is missing in the docstring of a public name, held against its signature."""

from __future__ import annotations

import builtins
import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import scanfab

SECTIONS = (
    "Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns", "Notes", "References",
    "Examples",
)  # fmt: skip


def named_in(section: str) -> list[str]:
    """The names that a section describes: those of its lines that are not indented."""
    lines = [line for line in section.splitlines() if line and not line.startswith(" ")]
    names = [line.split(" : ")[0] for line in lines]
    return [name.strip().lstrip("*") for line in names for name in line.split(",")]


def faults_of(thing: Any, with_example: bool = True) -> Iterator[str]:
    """Of a function, method, property or class: what numpydoc or the signature asks for."""
    text = inspect.getdoc(thing) or ""
    parts = re.split(r"^(\w+)\n-{3,}\n", text, flags=re.MULTILINE)
    found = dict(zip(parts[1::2], parts[2::2], strict=True))
    summary = text.split("\n\n")[0].strip()
    if not summary.endswith((".", ":")):
        yield f"has no summary that is a sentence, but {summary!r}"
    if list(found) != [title for title in SECTIONS if title in found]:
        yield f"has sections that numpydoc does not know, or in another order: {list(found)}"
    for error in named_in(found.get("Raises", "")):
        if not hasattr(scanfab, error) and not hasattr(builtins, error):
            yield f"raises {error}, which is no public error"
    is_class = inspect.isclass(thing)
    is_property = isinstance(thing, property | cached_property)
    if is_property or (is_class and issubclass(thing, Exception)):
        return
    signature = inspect.signature(thing)
    names = [name for name in signature.parameters if name not in ("self", "cls")]
    described = named_in(found.get("Parameters", ""))
    if is_class:
        described += named_in(found.get("Attributes", ""))
        fields = {name for one in thing.__mro__ for name in vars(one).get("__annotations__", {})}
        names += [one for one in described if one in fields or hasattr(thing, one)]
        described, names = sorted(set(described)), sorted(set(names))
    if described != names:
        yield f"describes {described}, but has or takes {names}"
    gives = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    if gives and not is_class and not {"Returns", "Yields"} & set(found):
        yield "does not say what it returns"
    if with_example and ">>>" not in found.get("Examples", ""):
        yield "has no example"


def members_of(kind: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that a class of this package brings itself."""
    for name in dir(kind):
        member = inspect.getattr_static(kind, name)
        owner = next(one for one in kind.__mro__ if name in vars(one))
        # a field may have a function for its usual value
        if name.startswith("_") or name in vars(owner).get("__annotations__", {}):
            continue
        member = getattr(member, "__func__", member)
        is_code = isinstance(member, property | cached_property) or inspect.isfunction(member)
        if owner.__module__.startswith("scanfab") and is_code:
            yield name, member


def faults(name: str) -> list[str]:
    """Of one public name and all that it brings; empty if there is nothing to mend."""
    named = getattr(scanfab, name)
    if not callable(named):
        return []
    found = [f"{name} {fault}" for fault in faults_of(named)]
    if inspect.isclass(named) and not issubclass(named, Exception):
        for member, value in members_of(named):
            found += [f"{name}.{member} {fault}" for fault in faults_of(value, with_example=False)]
    return found

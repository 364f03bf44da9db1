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


def sections_of(text: str) -> dict[str, str]:
    """The sections of a numpydoc docstring by their titles."""
    parts = re.split(r"^(\w+)\n-{3,}\n", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def named_in(section: str) -> list[str]:
    """The names that a section describes: those of its lines that are not indented."""
    lines = [line for line in section.splitlines() if line and not line.startswith(" ")]
    names = [line.split(" : ")[0] for line in lines]
    return [name.strip().lstrip("*") for line in names for name in line.split(",")]


def faults_of_function(function: Any, with_example: bool) -> Iterator[str]:
    """Of a function or method."""
    text = inspect.getdoc(function) or ""
    found = sections_of(text)
    yield from _faults_of_text(text, found)
    signature = inspect.signature(function)
    names = [name for name in signature.parameters if name not in ("self", "cls")]
    described = named_in(found.get("Parameters", ""))
    if described != names:
        yield f"describes the parameters {described}, but takes {names}"
    gives = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    if gives and not {"Returns", "Yields"} & set(found):
        yield "does not say what it returns"
    if with_example and ">>>" not in found.get("Examples", ""):
        yield "has no example"


def faults_of_class(kind: type) -> Iterator[str]:
    """Of a class: what it is made of and what it has, in its own docstring."""
    text = inspect.getdoc(kind) or ""
    found = sections_of(text)
    yield from _faults_of_text(text, found)
    if issubclass(kind, Exception):
        return
    described = named_in(found.get("Parameters", "")) + named_in(found.get("Attributes", ""))
    names = list(inspect.signature(kind).parameters)
    missing = [name for name in names if name not in described]
    if missing:
        yield f"does not describe {missing}"
    if len(set(described)) < len(described):
        yield f"describes something twice: {described}"
    for name in described:
        if name not in names and not _is_attribute(kind, name):
            yield f"describes {name}, which it does not have"
    if ">>>" not in found.get("Examples", ""):
        yield "has no example"


def _is_attribute(kind: type, name: str) -> bool:
    return hasattr(kind, name) or any(
        name in vars(one).get("__annotations__", {}) for one in kind.__mro__
    )


def members_of(kind: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that a class of this package brings itself."""
    for name in dir(kind):
        member = inspect.getattr_static(kind, name)
        owner = next(one for one in kind.__mro__ if name in vars(one))
        # a field may have a function for its usual value
        if name.startswith("_") or name in vars(owner).get("__annotations__", {}):
            continue
        if owner.__module__.startswith("scanfab"):
            yield name, member


def faults_of_member(member: Any) -> Iterator[str]:
    """Of a method or property; the summary of a property says what it is."""
    if isinstance(member, property | cached_property):
        text = inspect.getdoc(member) or ""
        yield from _faults_of_text(text, sections_of(text))
    elif isinstance(member, staticmethod | classmethod):
        yield from faults_of_function(member.__func__, with_example=False)
    elif inspect.isfunction(member):
        yield from faults_of_function(member, with_example=False)


def _faults_of_text(text: str, found: dict[str, str]) -> Iterator[str]:
    summary = text.split("\n\n")[0].strip()
    if not summary.endswith((".", ":")):
        yield f"has no summary that is a sentence, but {summary!r}"
    for title in found:
        if title not in SECTIONS:
            yield f"has a section {title!r}, which numpydoc does not know"
    if list(found) != [title for title in SECTIONS if title in found]:
        yield f"has its sections in another order than numpydoc: {list(found)}"
    for error in named_in(found.get("Raises", "")):
        if not hasattr(scanfab, error) and not hasattr(builtins, error):
            yield f"raises {error}, which is no public error"


def faults(name: str) -> list[str]:
    """Of one public name and all that it brings; empty if there is nothing to mend."""
    named = getattr(scanfab, name)
    if inspect.isclass(named):
        own = [f"{name} {fault}" for fault in faults_of_class(named)]
        if issubclass(named, Exception):
            return own
        return own + [
            f"{name}.{member} {fault}"
            for member, value in members_of(named)
            for fault in faults_of_member(value)
        ]
    if callable(named):
        return [f"{name} {fault}" for fault in faults_of_function(named, with_example=True)]
    return []

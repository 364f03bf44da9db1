"""What is wrong with a VTK file, told before a library reads it: what both syntaxes share."""

from __future__ import annotations

__all__ = ["FlawError"]


class FlawError(Exception):
    """A file does not hold what its headers promise."""

"""Numbers in messages: as short as possible, but still clear."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def counted(number: int, singular: str, plural: str = "") -> str:
    """
    A number and the word for what is counted, in singular or plural.

    Examples
    --------
    >>> from scanfab.base.spelling import counted
    >>> counted(1, "grain"), counted(1800, "grain"), counted(2, "axis", "axes")
    ('1 grain', '1800 grains', '2 axes')
    """
    return f"{number} {singular if number == 1 else plural or singular + 's'}"


def shortest(value: float) -> str:
    """
    The shortest text that reads back to the same number.

    Examples
    --------
    >>> from scanfab.base.spelling import shortest
    >>> shortest(2.0), shortest(0.1 + 0.2)
    ('2', '0.30000000000000004')
    """
    return f"{value:g}" if float(f"{value:g}") == value else repr(float(value))


def spelt_place(values: Iterable[float]) -> str:
    """
    The components of a point or vector, to four digits.

    Examples
    --------
    >>> from scanfab.base.spelling import spelt_place
    >>> spelt_place([1 / 3, -0.0, 2e-9])
    '(0.3333, 0, 2e-09)'
    """
    return f"({', '.join(f'{value + 0.0:.4g}' for value in values)})"


def meant(name: object, known: Iterable[str], what: str) -> str:
    """
    The advice for a wrong name: the most similar name of its kind, or all names.

    Examples
    --------
    >>> from scanfab.base.spelling import meant
    >>> meant("alpha_v", ["frame", "alpha_vs"], "column")
    "did you mean 'alpha_vs'?"
    >>> meant(3, ["frame", "alpha_vs"], "column")
    'the columns are frame, alpha_vs'
    """
    names = list(known)
    near = get_close_matches(str(name), names, n=1)
    return f"did you mean {near[0]!r}?" if near else f"the {what}s are {', '.join(names)}"


def spelt_time(seconds: float) -> str:
    """
    A duration with a suitable unit, rounded to about a tenth.

    Examples
    --------
    >>> from scanfab.base.spelling import spelt_time
    >>> [spelt_time(seconds) for seconds in (0.2, 70, 840, 9000)]
    ['1 s', '70 s', '14 min', '2.5 h']
    """
    if seconds < 100:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def spelt_apart(value: float, limit: float) -> tuple[str, str]:
    """
    Two numbers to two digits, or to as many digits as are needed to tell them apart.

    Examples
    --------
    >>> from scanfab.base.spelling import spelt_apart
    >>> spelt_apart(0.00100041, 0.001)
    ('0.0010004', '0.001')
    >>> spelt_apart(0.25, 0.25), spelt_apart(float("inf"), 1e-4)
    (('0.25', '0.25'), ('inf', '0.0001'))
    """
    for digits in range(2, 18):
        spelt = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if float(spelt[0]) != float(spelt[1]):
            return spelt
    return repr(value), repr(limit)

"""Numbers in messages, as short as they still say what is meant."""

from __future__ import annotations

__all__ = ["spelt_apart", "spelt_time"]


def spelt_time(seconds: float) -> str:
    """
    A time to wait, to about a tenth.

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
    Two numbers with two digits, or as many as tell them apart.

    Examples
    --------
    >>> from scanfab.base.spelling import spelt_apart
    >>> spelt_apart(0.00100041, 0.001)
    ('0.0010004', '0.001')
    """
    for digits in range(2, 18):
        spelt = f"{value:.{digits}g}", f"{limit:.{digits}g}"
        if float(spelt[0]) != float(spelt[1]):
            return spelt
    return repr(value), repr(limit)

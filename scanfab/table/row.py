"""Rows of tables: read-only mappings whose values are attributes as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any, NoReturn, Self

from scanfab.base.column import NoColumnError, no_column

# of a repr: a name and its value side by side, so many to a line
NAME_WIDTH, PAIRS = 26, 3


class Record(Mapping[str, Any]):
    """
    A row whose columns are the fields of a dataclass.

    Examples
    --------
    >>> from scanfab.table.comparison_rows import DifferenceRow
    >>> row = DifferenceRow(source="s", frame=0, strain=None, variants="a-b", difference=0.1,
    ...                     difference_se=None)
    >>> row["difference"] == row.difference == dict(row)["difference"]
    True
    """

    __slots__ = ()

    def __getitem__(self, name: str) -> Any:
        if name not in self:
            raise NoColumnError(no_column(name, self))
        return getattr(self, name)

    def __contains__(self, name: object) -> bool:
        return any(name == one for one in self)

    def __iter__(self) -> Iterator[str]:
        return (one.name for one in fields(self))  # type: ignore[arg-type]

    def __len__(self) -> int:
        return len(fields(self))  # type: ignore[arg-type]

    def get(self, name: str, default: Any = None) -> Any:
        """The value of a column that need not exist."""
        return getattr(self, name) if name in self else default


class Row(Mapping[str, Any]):
    """
    One frame and variant of a fabric table: ``row.alpha_vs`` or ``row["alpha_vs"]``.

    None is a value that does not exist. Lengths are in the dump's unit. A row that is computed has
    all columns (``scanfab.COLUMNS``), one that is read back has those of its file.

    Parameters
    ----------
    **values
        By the names of the columns.

    Raises
    ------
    ScanfabError
        If a column is asked for that does not exist; also a KeyError and an AttributeError.

    Examples
    --------
    >>> from scanfab import Row
    >>> row = Row(frame=0, variant="c", alpha_vs=0.0125)
    >>> row.alpha_vs == row["alpha_vs"]
    True
    >>> row.alpha_v
    Traceback (most recent call last):
    scanfab.base.column.NoColumnError: there is no column 'alpha_v': did you mean alpha_vs?
    >>> row
    Row(frame=0                     variant='c'                 alpha_vs=0.0125)
    """

    __slots__ = ("_values",)
    _values: dict[str, Any]

    def __init__(self, **values: Any) -> None:
        object.__setattr__(self, "_values", values)

    def __getitem__(self, name: str) -> Any:
        try:
            return self._values[name]
        except KeyError:
            raise NoColumnError(no_column(name, self)) from None

    def __getattr__(self, name: str) -> Any:
        # what Python itself looks for is no column
        if name.startswith("_"):
            raise AttributeError(name)
        return self[name]

    def __contains__(self, name: object) -> bool:
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return hash(tuple(self._values.values()))

    def get(self, name: str, default: Any = None) -> Any:
        """
        The value of a column that need not exist.

        Parameters
        ----------
        name : str
            Of the column.
        default : object, optional
            In place of a column that does not exist.

        Returns
        -------
        object
        """
        return self._values.get(name, default)

    def with_values(self, **values: Any) -> Self:
        """
        The same row with other values, or with more columns behind.

        Parameters
        ----------
        **values
            By the names of the columns.

        Returns
        -------
        Row
        """
        return type(self)(**{**self._values, **values})

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise AttributeError(f"{name}: a row cannot be changed; with_values makes a new one")

    def __delattr__(self, name: str) -> NoReturn:
        self.__setattr__(name, None)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (self._values,)

    def __repr__(self) -> str:
        # the values without each octant are for fits, not for eyes
        shown = [name for name in self if "_without_" not in name and "_half_" not in name]
        pairs = [f"{name}={spelt_value(self[name])}" for name in shown if self[name] is not None]
        cells = [one.ljust(NAME_WIDTH) for one in pairs]
        lines = ["  ".join(cells[k : k + PAIRS]).rstrip() for k in range(0, len(cells), PAIRS)]
        return "Row({})".format("\n    ".join(lines))


def _unpickled(values: dict[str, Any]) -> Row:
    return Row(**values)


def spelt_value(value: Any) -> str:
    """A value as a repr shows it: four digits say enough."""
    return f"{value:.4g}" if isinstance(value, float) else repr(value)

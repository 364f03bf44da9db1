"""Tables: computed, read from a file, or made by a comparison."""

from __future__ import annotations

import html
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from scanfab.base.column import DEFAULT_DIGITS, Column, NoColumnError
from scanfab.base.errors import ReadError, SettingsError
from scanfab.base.spelling import counted
from scanfab.base.typing import FloatArray
from scanfab.fabric.tensor import COMPONENTS
from scanfab.table.columns import MORE_COLUMNS, table_columns
from scanfab.table.formats import data_frame, read_rows
from scanfab.table.plots import Plots
from scanfab.table.row import Row, shown_cells
from scanfab.table.selection import MAP
from scanfab.table.writing import Excerpt, plain, write_rows

if TYPE_CHECKING:
    import pandas
    import polars

    from scanfab.table.compare import Comparison


def load(path: Path | str) -> Table:
    """
    Read a table that :meth:`Table.save` or ``scanfab compute -o`` has written.

    Parameters
    ----------
    path : path
        File in CSV, TSV, JSON, JSON lines, Parquet or a format of another package; the content
        decides the format.

    Returns
    -------
    Table
        The table with the columns of the file; a missing value is None.

    Raises
    ------
    ReadError
        If the file cannot be read as a table; the message names the line of a text file.

    Examples
    --------
    >>> import scanfab
    >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
    >>> table[0].contacts
    2076
    """
    rows = read_rows(path)
    try:
        return Table(rows)
    except SettingsError as error:
        raise ReadError(f"{path}: {error}") from None


class Table(Sequence[Row]):
    """
    Rows with named columns: ``table[0]`` is a row, ``table["alpha_vs"]`` a column as an array.

    Parameters
    ----------
    rows : iterable of mapping
        Values by column; missing values are None.
    columns : sequence of Column, optional
        Declarations of the columns. By default columns are declared as in fabric tables, and the
        kind of any other column follows from its values.

    Examples
    --------
    >>> from scanfab import Table
    >>> table = Table([dict(frame=0, variant="c", alpha_vs=0.01), dict(frame=1, variant="c")])
    >>> table[0].alpha_vs
    0.01
    >>> table["alpha_vs"]
    array([0.01,  nan])
    >>> len(table.select(frame=1)), len(table[:1])
    (1, 1)
    """

    columns: tuple[Column, ...]
    """Declarations of the columns."""

    def __init__(
        self, rows: Iterable[Mapping[str, Any]] = (), columns: Sequence[Column] | None = None
    ) -> None:
        values = [{name: plain(value) for name, value in row.items()} for row in rows]
        self.columns = _columns(values) if columns is None else tuple(columns)
        self._frame = data_frame(values, self.columns)

    def __len__(self) -> int:
        return self._frame.height

    def __iter__(self) -> Iterator[Row]:
        return (Row(**values) for values in self._frame.iter_rows(named=True))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self._frame.equals(other._frame)

    @overload
    def __getitem__(self, key: int) -> Row: ...
    @overload
    def __getitem__(self, key: slice) -> Table: ...
    @overload
    def __getitem__(self, key: str) -> npt.NDArray[Any]: ...
    def __getitem__(self, key: int | slice | str) -> Row | Table | npt.NDArray[Any]:
        if isinstance(key, slice):
            return Table(self._frame[key].to_dicts(), self.columns)
        if not isinstance(key, str):
            return Row(**self._frame.row(range(len(self))[key], named=True))
        if key not in self.names:
            raise NoColumnError(key, self.names)
        values = self._frame[key]
        if values.dtype.is_numeric():
            return values.to_numpy(writable=True)
        return np.array(values.to_list(), dtype=object if values.null_count() else None)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(column.name for column in self.columns)

    @property
    def plot(self) -> Plots:
        """Figures of the table: ``table.plot.evolution(ax=ax)`` draws one on given Axes."""
        return Plots(self, "map" if MAP in self.names else "table")

    def select(self, **wanted: Any) -> Table:
        """
        Select the rows whose columns have the given values.

        Parameters
        ----------
        **wanted
            Values by column, for instance ``variant="a"``.

        Returns
        -------
        Table

        Raises
        ------
        ScanfabError
            If there is no such column; the message suggests the most similar name.

        Examples
        --------
        >>> import scanfab
        >>> table = scanfab.load("sample_data/yade_triaxial/engine.csv")
        >>> [row.contacts for row in table.select(frame=0)]
        [2076]
        """
        chosen = (row for row in self if all(row[k] == value for k, value in wanted.items()))
        return Table(chosen, self.columns)

    def tensor(self, name: str) -> FloatArray:
        """
        The fabric tensors of all rows.

        Parameters
        ----------
        name : str
            ``"gvs"`` for the void fabric, ``"gc"`` for the contact fabric.

        Returns
        -------
        ndarray, shape (rows, 3, 3)
            Dimensionless tensors of trace 1; NaN for rows without a tensor.

        Raises
        ------
        ScanfabError
            If the table lacks the columns of the tensor.

        Examples
        --------
        >>> from scanfab import Table
        >>> row = dict(gc_xx=0.3, gc_yy=0.3, gc_zz=0.4, gc_xy=0.0, gc_xz=0.0, gc_yz=0.1)
        >>> Table([row]).tensor("gc")[0, 2, 1]
        np.float64(0.1)
        """
        tensors = np.empty((len(self), 3, 3))
        for component, (i, j) in COMPONENTS.items():
            tensors[:, i, j] = tensors[:, j, i] = self[f"{name}_{component}"]
        return tensors

    def compare(self, *, strain_max: float | None = None) -> Comparison:
        """
        Compare void with contact fabric, and variants: see :func:`scanfab.compare_tables`.

        Parameters
        ----------
        strain_max : float, optional
            Leave frames beyond this strain, a fraction, out of the fits.

        Returns
        -------
        Comparison
            Slopes with errors for each source and variant, and tables of all compared rows.

        Raises
        ------
        SettingsError
            If the table lacks a column, or has several rows for the same frame and variant.
        """
        from scanfab.table.compare import compare_tables

        return compare_tables(self, strain_max=strain_max)

    def save(
        self,
        path: Path | str,
        *,
        fields: str | Sequence[str] | None = None,
        digits: int = DEFAULT_DIGITS,
    ) -> None:
        """
        Write the table to a file; a computed table has the bytes of ``scanfab compute -o``.

        Parameters
        ----------
        path : path
            File with the suffix ``.csv``, ``.tsv``, ``.json``, ``.jsonl``, ``.parquet`` or of a
            format of another package. An existing file is replaced when the new one is complete.
            NaN and infinite numbers are written as missing values.
        fields : str or sequence of str, optional
            Names of the columns to write, in this order: a sequence, or a text with commas.
        digits : int, optional
            Significant digits of floats; with 17, the shortest text that reads back to the same
            number.

        Raises
        ------
        SettingsError
            If no format has the suffix, or a column or the folder does not exist.

        Examples
        --------
        >>> import scanfab, tempfile
        >>> table = scanfab.Table([dict(frame=0, alpha_vs=0.01)])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     table.save(f"{folder}/table.csv")
        ...     scanfab.load(f"{folder}/table.csv") == table
        True
        """
        write_rows(Path(path), self, self.columns, Excerpt.make(self.columns, fields, digits))

    def to_pandas(self) -> pandas.DataFrame:
        """
        Convert the table to a pandas data frame.

        Returns
        -------
        pandas.DataFrame
            The table; missing numbers are NaN.

        Raises
        ------
        SettingsError
            If pandas is not installed.
        """
        if find_spec("pandas") is None:
            raise SettingsError("to_pandas needs the package pandas: pip install pandas") from None
        return self._frame.to_pandas()

    def to_polars(self) -> polars.DataFrame:
        """
        Convert the table to a polars data frame.

        Returns
        -------
        polars.DataFrame
            The table; missing values are null.

        Examples
        --------
        >>> from scanfab import Table
        >>> Table([dict(frame=0, alpha_vs=0.01), dict(frame=1)]).to_polars()["alpha_vs"].to_list()
        [0.01, None]
        """
        return self._frame.clone()

    def __repr__(self) -> str:
        lines = shown_cells(list(self), self.names) if len(self) else []
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        padded = ["  ".join(map(str.rjust, line, widths)) for line in lines]
        return "\n".join([f"Table of {counted(len(self), 'row')}", *padded])

    def _repr_html_(self) -> str:
        cells = shown_cells(list(self), self.names)
        heads, *lines = [[html.escape(cell) for cell in line] for line in cells]
        head = "".join(f"<th>{title}</th>" for title in heads)
        body = "".join(f"<tr><td>{'</td><td>'.join(line)}</td></tr>" for line in lines)
        return (
            f"<table><caption>Table of {counted(len(self), 'row')}</caption>"
            f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        )


def _columns(rows: Sequence[Mapping[str, Any]]) -> tuple[Column, ...]:
    """The columns of rows: declared as in fabric tables, others by the kinds of their values."""
    if not rows:
        return table_columns()
    columns = {column.name: column for column in (*table_columns(), *MORE_COLUMNS)}
    names = dict.fromkeys(name for row in rows for name in row)
    for name in names:
        if name not in columns:
            kinds = {type(row.get(name)) for row in rows}
            kind = next((kind for kind in (list, str, float, int) if kind in kinds), float)
            columns[name] = Column(name, kind, "", "")
    return tuple(columns[name] for name in names)

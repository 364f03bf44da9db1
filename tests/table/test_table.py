"""The fabric table as rows and columns."""

import copy
import pickle
import sys

import numpy as np
import pytest

from scanfab.base.errors import ScanfabError, SettingsError
from scanfab.table import formats
from scanfab.table.columns import COLUMNS, table_columns
from scanfab.table.formats import OWN_FORMATS
from scanfab.table.row import Row
from scanfab.table.table import Table, load
from scanfab.table.writing import write_rows

# the columns that scripts rely on
FIXED = """
source frame step time strain variant
grains rattlers contacts contacts_from coordination solid_fraction
directions replicates lines segments spacing cutoff mean_length
gvs_xx gvs_yy gvs_zz gvs_xy gvs_xz gvs_yz alpha_vs alpha_vs_axial alpha_vs_axial_se
gc_xx gc_yy gc_zz gc_xy gc_xz gc_yz alpha_c alpha_c_axial alpha_c_axial_se
"""


def a_row(**values):
    """A row without any value, but those given."""
    texts = {"source": "dumps", "variant": "a", "contacts_from": "file"}
    counts = dict.fromkeys(("frame", "grains", "rattlers", "contacts", "lines", "segments"), 0)
    return Row(**{**dict.fromkeys(COLUMNS), **texts, **counts, **values})


@pytest.fixture
def table():
    return Table(
        a_row(frame=frame, variant=variant, strain=0.1 * frame or None, step=10 * frame)
        for frame in range(3)
        for variant in "ab"
    )


@pytest.fixture
def results():
    """Three frames of one variant, with errors."""
    names = ("gvs_xx", "gvs_yy", "gvs_zz", "gvs_xy", "gvs_xz", "gvs_yz")
    tensor = dict(zip(names, (0.3, 0.3, 0.4, 0.01, 0.02, 0.03), strict=True))
    errors = {"alpha_vs_axial_se": 3e-5, "alpha_vs_axial_sample_se": 4e-5, "variant": "c"}
    rows = [
        {"frame": k, "strain": 0.01 * k, "alpha_vs_axial": 1e-3 * k, "alpha_c_axial": 1e-2 * k}
        for k in range(3)
    ]
    rows[0]["gvs_xz"] = None
    return Table(a_row(**{**tensor, **errors, **row}) for row in rows)


def test_scripts_rely_on_the_columns_and_their_order():
    fixed = tuple(FIXED.split())
    assert COLUMNS[: len(fixed)] == fixed
    added = {"alpha_vs_axial_sample_se", "gvs_axis_x", "gc_axis_z", "coaxiality_deg"}
    assert added <= set(COLUMNS[len(fixed) :])


def test_a_table_is_a_sequence_of_rows(table):
    assert len(table) == len(list(table)) == 6
    assert (table[0].variant, table[-1].frame) == ("a", 2)
    assert isinstance(table[:2], Table)
    assert [row.variant for row in table[:2]] == ["a", "b"]
    with pytest.raises(IndexError):
        table[6]


def test_a_column_is_an_array_and_missing_numbers_are_nan(table):
    np.testing.assert_array_equal(table["frame"], [0, 0, 1, 1, 2, 2])
    np.testing.assert_allclose(table["strain"], [np.nan, np.nan, 0.1, 0.1, 0.2, 0.2])
    assert table["variant"].tolist() == ["a", "b"] * 3
    assert np.isnan(table["alpha_vs"]).all()
    assert len(Table([])["alpha_vs"]) == 0


ASKS = [
    lambda table: table["alpha_v"],
    lambda table: table.select(alpha_v=1),
    lambda table: table[0].alpha_v,
    lambda table: table[0]["alpha_v"],
]


@pytest.mark.parametrize("ask", ASKS)
def test_a_column_that_does_not_exist_is_an_error_that_names_the_nearest(table, ask):
    with pytest.raises(KeyError, match=r"^there is no column 'alpha_v': did you mean 'alpha_vs'"):
        ask(table)
    with pytest.raises(ScanfabError, match="no column 'qqq': the columns are source, frame"):
        table["qqq"]
    assert not hasattr(table[0], "qqq")


def test_rows_are_selected_by_their_values(table):
    assert [row.frame for row in table.select(variant="b")] == [0, 1, 2]
    assert len(table.select(variant="b", frame=1)) == len(table.select(strain=None)) - 1 == 1
    assert len(table.select(variant="d")) == 0


def test_a_row_cannot_be_changed_but_copied():
    row = a_row(frame=3)
    with pytest.raises(AttributeError):
        row.frame = 5
    with pytest.raises(TypeError):
        row["frame"] = 5
    for twin in (copy.copy(row), copy.deepcopy(row), pickle.loads(pickle.dumps(row))):
        assert twin == a_row(frame=3) != a_row(frame=4)


def test_a_table_is_shown_with_values_and_their_errors(results):
    shown = repr(results).splitlines()
    assert shown[0] == "Table of 3 rows"
    assert "0.002000 ± 0.000050" in shown[-1]
    assert repr(Table()) == "Table of 0 rows"
    long = repr(Table([*results] * 30)).splitlines()
    assert len(long) == 13
    assert "..." in long[7]
    of_notebook = Table([{"source": "<b>", "frame": 0}])._repr_html_()
    assert "<td>&lt;b&gt;</td>" in of_notebook


def test_tensors_have_their_components_and_their_symmetry(results):
    found = results.tensor("gvs")
    assert found.shape == (3, 3, 3)
    np.testing.assert_array_equal(found, np.swapaxes(found, 1, 2))
    expected = [[0.3, 0.01, 0.02], [0.01, 0.3, 0.03], [0.02, 0.03, 0.4]]
    np.testing.assert_array_equal(found[1], expected)
    assert np.isnan(found[0, 0, 2])
    with pytest.raises(ScanfabError, match="no column 'gv_xx': did you mean 'gvs_xx'"):
        results.tensor("gv")


@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])
def test_a_saved_table_has_the_bytes_of_the_command_line_and_is_loaded_again(
    results, tmp_path, suffix
):
    write_rows(tmp_path / f"by_command{suffix}", results, table_columns())
    path = tmp_path / f"saved{suffix}"
    results.save(path)
    assert path.read_bytes() == (tmp_path / f"by_command{suffix}").read_bytes()
    assert load(path) == results
    load(path).save(path)
    assert load(path) == results
    # that of a packing has no name
    unnamed = Table(Row(**{**row, "source": ""}) for row in results)
    unnamed.save(path)
    assert load(path) == unnamed
    assert load(path).compare().summary == unnamed.compare().summary


def test_a_table_with_other_columns_keeps_them(tmp_path):
    table = Table([{"frame": 1, "mine": 0.5}, {"frame": 2, "word": "x"}])
    assert [column.kind for column in table.columns] == [int, float, str]
    table.save(tmp_path / "t.parquet")
    assert load(tmp_path / "t.parquet") == table
    np.testing.assert_array_equal(table["mine"], [0.5, np.nan])
    # of another program: fractions for counts, and words for numbers
    (tmp_path / "t.csv").write_text("frame,strain\n0.0,0.1\n1,no\n")
    found = [Row(frame=0.0, strain="0.1"), Row(frame=1.0, strain="no")]
    assert list(load(tmp_path / "t.csv")) == found


def test_data_frames_have_the_columns_and_kinds(results, monkeypatch):
    frame = results.to_polars()
    assert tuple(frame.columns) == COLUMNS
    assert frame["alpha_vs_axial"].to_list() == list(results["alpha_vs_axial"])
    assert str(frame.schema["grains"]) == "Int64"
    lists = Table([{"a": [1, 2], "n": np.int64(3)}, {"a": None, "n": None}]).to_polars()
    assert (lists["a"].to_list(), lists["n"].to_list()) == ([[1, 2], None], [3, None])
    assert tuple(results.to_pandas().columns) == COLUMNS
    tensors = Table([{"a": [1.0, 2.0]}, {"a": None}])
    assert tensors.to_pandas()["a"][0].tolist() == tensors["a"][0] == [1.0, 2.0]
    assert tensors["a"][1] is None
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(SettingsError, match="to_pandas needs the package pandas: pip install"):
        results.to_pandas()


class Sections:
    """A made-up format: a line for each row, as other packages may offer one."""

    suffix, description, is_text = ".rows", "a line for each row", True

    def recognises(self, data):
        return data.startswith(b"rows:")

    def write(self, stream, rows, columns):
        stream.write("\n".join(["rows:", *(repr(dict(row)) for row in rows)]))

    def read(self, data, name):
        return [eval(line) for line in data.decode().splitlines()[1:]]


def test_a_foreign_format_is_like_the_own_ones(results, tmp_path, monkeypatch):
    monkeypatch.setattr(formats, "foreign_formats", lambda: (Sections(),))
    path = tmp_path / "t.rows"
    results.save(path)
    assert path.read_text().startswith("rows:\n{'source': 'dumps'")
    # told by its content, whatever it is called
    assert load(path.rename(tmp_path / "table")) == results
    with pytest.raises(SettingsError, match=r"can be written as .*\.parquet, .rows, not as .xls"):
        results.save(tmp_path / "t.xls")


def test_a_figure_that_does_not_exist_is_an_error_that_names_the_nearest(results):
    with pytest.raises(AttributeError, match="no figure 'evolutoin': did you mean 'evol"):
        results.plot.evolutoin  # noqa: B018

"""The fabric table as rows and columns."""

from __future__ import annotations

import copy
import pickle
import sys

import numpy as np
import pandas
import pytest

import scanfab
from scanfab.base.errors import ReadError, ScanfabError, SettingsError
from scanfab.table import formats
from scanfab.table.columns import COLUMNS
from scanfab.table.compare import compare_tables
from scanfab.table.formats import OWN_FORMATS
from scanfab.table.reading import read_rows
from scanfab.table.result_file import ResultFile
from scanfab.table.row import Row
from scanfab.table.table import Table, load

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
    counts = dict.fromkeys(
        (
            "frame",
            "grains",
            "rattlers",
            "contacts",
            "directions",
            "replicates",
            "lines",
            "segments",
        ),
        0,
    )
    return Row(**{**dict.fromkeys(COLUMNS), **texts, **counts, **values})


@pytest.fixture
def table():
    return Table(
        a_row(frame=frame, variant=variant, strain=0.1 * frame or None, step=10 * frame)
        for frame in range(3)
        for variant in "ab"
    )


def test_scripts_rely_on_the_columns_and_their_order():
    fixed = tuple(FIXED.split())
    assert COLUMNS[: len(fixed)] == fixed
    added = {"alpha_vs_axial_sample_se", "gvs_axis_x", "gc_axis_z", "coaxiality_deg"}
    assert added <= set(COLUMNS[len(fixed) :])


def test_a_table_is_a_sequence_of_rows(table):
    assert len(table) == len(list(table)) == 6
    assert table[0].variant == "a"
    assert table[-1].frame == 2
    assert [row.variant for row in table[:2]] == ["a", "b"]
    assert isinstance(table[:2], Table)


def test_a_column_is_an_array_and_missing_numbers_are_nan(table):
    np.testing.assert_array_equal(table["frame"], [0, 0, 1, 1, 2, 2])
    np.testing.assert_allclose(table["strain"], [np.nan, np.nan, 0.1, 0.1, 0.2, 0.2])
    assert table["variant"].tolist() == ["a", "b"] * 3
    assert np.isnan(table["alpha_vs"]).all()


def test_a_column_that_does_not_exist_is_an_error_that_names_the_nearest_or_lists_them(table):
    for ask in (
        lambda: table["alpha_v"],
        lambda: table.select(alpha_v=1),
        lambda: table[0].alpha_v,
        lambda: table[0]["alpha_v"],
    ):
        with pytest.raises(KeyError, match=r"^there is no column 'alpha_v': did you mean alpha_vs"):
            ask()
    with pytest.raises(ScanfabError, match="no column 'qqq': the columns are source, frame"):
        table["qqq"]


def test_rows_are_selected_by_their_values(table):
    assert [row.frame for row in table.select(variant="b")] == [0, 1, 2]
    assert len(table.select(variant="b", frame=1)) == 1
    assert len(table.select(variant="d")) == 0


def test_an_empty_table_has_empty_columns():
    assert len(Table([])["alpha_vs"]) == 0


def test_a_row_cannot_be_changed():
    row = a_row(frame=3)
    with pytest.raises(AttributeError, match="frame: a row cannot be changed"):
        row.frame = 5
    with pytest.raises(AttributeError, match="frame: a row cannot be changed"):
        del row.frame
    with pytest.raises(TypeError):
        row["frame"] = 5
    assert row.frame == 3


def test_rows_survive_copies_and_pickles():
    row = a_row(frame=3)
    for twin in (copy.copy(row), copy.deepcopy(row), pickle.loads(pickle.dumps(row))):
        assert twin == row
        assert hash(twin) == hash(row)


def test_a_row_is_shown_in_a_few_lines_without_what_does_not_exist():
    shown = repr(a_row(alpha_vs=1 / 3, alpha_vs_axial_without_1=0.1))
    assert len(shown.splitlines()) <= 6
    assert "alpha_vs=0.3333" in shown
    assert "None" not in shown
    assert "without" not in shown


@pytest.fixture
def results():
    """Three frames of one variant, with errors."""
    return Table(
        a_row(
            frame=frame,
            variant="c",
            strain=0.01 * frame,
            alpha_vs_axial=0.001 * frame,
            alpha_vs_axial_se=3e-5,
            alpha_vs_axial_sample_se=4e-5,
            alpha_c_axial=0.01 * frame,
            gvs_xx=0.3,
            gvs_yy=0.3,
            gvs_zz=0.4,
            gvs_xy=0.01,
            gvs_xz=0.02 if frame else None,
            gvs_yz=0.03,
        )
        for frame in range(3)
    )


def test_a_table_is_shown_with_values_and_their_errors(results):
    shown = repr(results).splitlines()
    assert shown[0] == "Table of 3 rows"
    assert "0.002000 ± 0.000050" in shown[-1]
    assert repr(Table()) == "Table of 0 rows"


def test_of_a_long_table_both_ends_are_shown(results):
    shown = repr(Table([*results] * 30)).splitlines()
    assert len(shown) == 13
    assert "..." in shown[7]


def test_a_notebook_gets_the_same_as_html():
    shown = Table([{"source": "<b>", "frame": 0}])._repr_html_()
    assert "<td>&lt;b&gt;</td>" in shown
    assert "<b>" not in shown


def test_tensors_have_their_components_and_their_symmetry(results):
    found = results.tensor("gvs")
    assert found.shape == (3, 3, 3)
    np.testing.assert_array_equal(found, np.swapaxes(found, 1, 2))
    np.testing.assert_array_equal(
        found[1], [[0.3, 0.01, 0.02], [0.01, 0.3, 0.03], [0.02, 0.03, 0.4]]
    )
    assert np.isnan(found[0, 0, 2])
    with pytest.raises(ScanfabError, match="no column 'gv_xx': did you mean gvs_xx"):
        results.tensor("gv")


def test_a_table_compares_itself(results):
    found = results.compare()
    assert found.slope == pytest.approx([0.1])
    assert found.peak == pytest.approx([0.002])
    assert np.isnan(found.slope_se).all()
    assert compare_tables(results).summary == found.summary
    assert "variant c: slope 0.1, 3 frames" in repr(found)
    assert Table(found.frames)["alpha_vs_axial_norm"] == pytest.approx([0, 0.5, 1])


@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS])
def test_a_saved_table_has_the_bytes_of_the_command_line_and_is_loaded_again(
    results, tmp_path, suffix
):
    with ResultFile(tmp_path / f"by_command{suffix}", Row).writer({}) as writer:
        for row in results:
            writer.write(row)
    path = tmp_path / f"saved{suffix}"
    results.save(path)
    assert path.read_bytes() == (tmp_path / f"by_command{suffix}").read_bytes()
    assert load(path) == results
    load(path).save(path)
    assert load(path) == results


def test_some_columns_and_digits_are_saved(results, tmp_path):
    results.save(tmp_path / "t.parquet", fields="strain,frame", digits=1)
    assert load(tmp_path / "t.parquet").names == ("strain", "frame")
    with pytest.raises(SettingsError, match="did you mean strain"):
        results.save(tmp_path / "t.csv", fields="strains")
    with pytest.raises(SettingsError, match="there is no folder"):
        results.save(tmp_path / "nowhere" / "t.csv")


def test_a_table_with_other_columns_keeps_them(tmp_path):
    table = Table([{"frame": 1, "mine": 0.5}, {"frame": 2, "word": "x"}])
    assert [column.kind for column in table.columns] == [int, float, str]
    table.save(tmp_path / "t.parquet")
    assert load(tmp_path / "t.parquet") == table
    np.testing.assert_array_equal(table["mine"], [0.5, np.nan])


def test_data_frames_have_the_columns_and_kinds(results):
    frame = results.to_polars()
    assert tuple(frame.columns) == COLUMNS
    assert frame["alpha_vs_axial"].to_list() == list(results["alpha_vs_axial"])
    assert frame["alpha_vs"].null_count() == 3
    assert str(frame.schema["grains"]) == "Int64"


def test_pandas_is_needed_where_it_is_asked_for(results, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(SettingsError, match="to_pandas needs the package pandas: pip install"):
        results.to_pandas()


def test_a_data_frame_of_pandas(results):
    frame = results.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert tuple(frame.columns) == COLUMNS


class Sections:
    """A made-up format: a section for each row, as other packages may offer one."""

    suffix = ".ini"
    description = "a section for each row"
    is_text = True

    def recognises(self, data):
        return data.startswith(b"[row]")

    def write(self, stream, rows, columns):
        for row in rows:
            lines = (f"{name}={value!r}\n" for name, value in row.items())
            stream.write("[row]\n" + "".join(lines))

    def read(self, data, name):
        sections = data.decode().split("[row]\n")[1:]
        try:
            return [
                {
                    key: eval(value)
                    for key, value in (line.split("=", 1) for line in one.splitlines())
                }
                for one in sections
            ]
        except ValueError:
            raise ReadError(f"{name}: expected NAME=VALUE") from None


@pytest.fixture
def sections(monkeypatch):
    monkeypatch.setattr(formats, "foreign_formats", lambda: (Sections(),))


@pytest.mark.usefixtures("sections")
def test_a_foreign_format_is_written_resumed_and_read_like_the_own_ones(results, tmp_path):
    path = tmp_path / "t.ini"
    results.save(path)
    assert path.read_text().startswith("[row]\nsource='dumps'\n")
    assert load(path) == results
    result = ResultFile(tmp_path / "by_command.ini", Row)
    with result.writer({}) as writer:
        for row in results:
            writer.write(row)
    assert result.path.read_bytes() == path.read_bytes()
    # told by its content, whatever it is called
    assert read_rows(path.rename(tmp_path / "table")) == [dict(row) for row in results]


@pytest.mark.usefixtures("sections")
def test_a_foreign_format_is_listed_and_takes_no_files_from_the_others(results, tmp_path):
    assert list(formats.known_formats())[-1] == ".ini"
    with pytest.raises(SettingsError, match=r"can be written as .*\.parquet, .ini, not as .xls"):
        results.save(tmp_path / "t.xls")
    results.save(tmp_path / "t.csv")
    assert load(tmp_path / "t.csv") == results


def test_figures_draw_on_the_axes_that_they_get(results):
    from matplotlib.figure import Figure

    for name in ("evolution", "normalised", "correlation"):
        assert name in dir(results.plot)
        ax = Figure().subplots()
        assert getattr(results.plot, name)(ax=ax) is ax
        assert ax.get_xlabel()
        assert ax.get_ylabel()
        assert ax.get_legend() is not None
    ax = Figure().subplots()
    results.plot.evolution(ax=ax, of="contacts")
    assert ax.lines[0].get_ydata() == pytest.approx([0, 1, 2])
    with pytest.raises(SettingsError, match="of: expected voids or contacts, found 'both'"):
        results.plot.evolution(ax=ax, of="both")
    with pytest.raises(TypeError, match="the figure evolution has no option 'fo': there are of"):
        results.plot.evolution(ax=ax, fo="contacts")
    with pytest.raises(AttributeError, match="there is no figure 'evolutoin': did you mean evol"):
        results.plot.evolutoin()


def test_what_cannot_share_one_axes_is_refused(results):
    mixed = Table(
        row.with_values(source=source, variant=variant)
        for row in results
        for source in "xy"
        for variant in "cd"
    )
    with pytest.raises(SettingsError, match=r"too many for one Axes: choose some, .*select"):
        mixed.plot.evolution()


@pytest.mark.parametrize("suffix", [one.suffix for one in OWN_FORMATS if one.suffix != ".jsonl"])
def test_a_table_without_rows_is_saved_and_loaded(tmp_path, suffix):
    Table().save(tmp_path / f"t{suffix}")
    assert load(tmp_path / f"t{suffix}") == Table()
    assert load(tmp_path / f"t{suffix}").names == COLUMNS


def test_the_public_names():
    assert scanfab.load is load
    assert scanfab.Row is Row
    assert scanfab.COLUMNS is COLUMNS


def test_lists_and_numbers_of_numpy_go_to_polars():
    frame = Table([{"a": [1, 2], "n": np.int64(3)}, {"a": None, "n": None}]).to_polars()
    assert frame["a"].to_list() == [[1, 2], None]
    assert frame["n"].to_list() == [3, None]

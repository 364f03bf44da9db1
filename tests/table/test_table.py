"""The fabric table as rows and columns."""

from __future__ import annotations

import numpy as np
import pytest

from scanfab.table.table import COLUMNS, Row, Table

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
    assert repr(table) == "Table(6 rows)"


def test_a_column_is_an_array_and_missing_numbers_are_nan(table):
    np.testing.assert_array_equal(table["frame"], [0, 0, 1, 1, 2, 2])
    np.testing.assert_allclose(table["strain"], [np.nan, np.nan, 0.1, 0.1, 0.2, 0.2])
    assert table["variant"].tolist() == ["a", "b"] * 3
    assert np.isnan(table["alpha_vs"]).all()


def test_a_column_that_does_not_exist_is_an_error_that_lists_the_others(table):
    with pytest.raises(KeyError, match="no column 'alpha'; the columns are source, frame"):
        table["alpha"]


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

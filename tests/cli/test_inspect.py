"""scanfab inspect: JSON for scripts, lines for people."""

import json

import pytest

from tests.helpers.dumps import cubic_rows, dump_text, pairs_text, write

KEYS = (
    "source frame step time format grains boundary radius_min radius_max contacts contacts_from "
    "rattlers coordination cell periodic columns warnings low high rv_center rv_radius rv_shape "
    "clumps spheres"
)


@pytest.fixture
def frames(ask):
    def frames(*words):
        return [json.loads(line) for line in ask("inspect", "--json", *words).out.splitlines()]

    return frames


def test_json_is_an_object_a_line_with_what_the_reader_sees(tmp_path, frames):
    """Of a box that is periodic along x and y; the first frame has a contact file."""
    for frame in (0, 1):
        text = dump_text(cubic_rows(), step=10 * frame, box=((0, 4),) * 3, flags=" pp pp ff")
        write(tmp_path / f"dump_{frame}.txt", text)
    write(tmp_path / "pairs_0.txt", pairs_text())
    first, second = frames(tmp_path, "--boundary", "id>=63")
    assert list(first) == list(second) == KEYS.split()
    assert [(one["frame"], one["step"]) for one in (first, second)] == [(0, 0), (1, 10)]
    expected = {
        "source": str(tmp_path), "format": "liggghts", "grains": 62, "boundary": 2, "contacts": 2,
        "contacts_from": "file", "cell": [[4, 0, 0], [0, 4, 0], [0, 0, 4]], "time": None,
        "periodic": [True, True, False], "warnings": [],
    }  # fmt: skip
    assert {name: first[name] for name in expected} == expected
    assert set(first["columns"]) == {"id", "type", "x", "y", "z", "radius"}
    assert 0 < first["radius_min"] < first["radius_max"]
    assert "no contact file for step 10" in second["warnings"][0]


def test_it_takes_the_options_of_compute(tmp_path, frames):
    file = write(tmp_path / "dump.txt", dump_text(names="id type x y z mass"))
    words = ("--radius", "0.2", "--cell", "1", "1", "1", "--periodic", "z")
    (frame,) = frames(file, *words, "--rv-shape", "cylinder")
    assert frame["radius_max"] == 0.2
    assert frame["periodic"] == [False, False, True]
    assert frame["rv_shape"].startswith("cylinder of radius ")

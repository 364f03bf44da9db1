"""What may stand on a command line as a source, and what is paired with what."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import pyvista

import scanfab
from scanfab.base.errors import SettingsError
from scanfab.cli.main import run
from tests.helpers.dumps import cubic_rows, dump_text, write
from tests.helpers.interruptions import PROGRAM, write_series

ROOT = Path(__file__).parents[2]
YADE = ROOT / "sample_data" / "yade_triaxial"
FLOOR = ROOT / "sample_data" / "liggghts_formats" / "floor"
FAST = ["--directions", "9", "--spacing", "1rmin", "--variants", "c"]

POSITION = np.array([[0.0, 0, 0], [1.9, 0, 0], [3.8, 0, 0], [1.9, 1.9, 0]])
PAIRS = np.array([[0, 1], [1, 2], [1, 3]])


def grains_with_lines(path: Path, vertices: bool = False) -> Path:
    """One VTK file with grains as points and contacts as lines between them."""
    lines = np.column_stack([np.full(3, 2), PAIRS]).ravel()
    verts = np.column_stack([np.full(4, 1), np.arange(4)]).ravel() if vertices else None
    mesh = pyvista.PolyData(POSITION, verts=verts, lines=lines)
    mesh["radius"] = np.ones(4)
    if path.suffix == ".vtu":
        mesh = mesh.cast_to_unstructured_grid()
    mesh.save(str(path))
    return path


@pytest.mark.parametrize("vertices", [False, True])
@pytest.mark.parametrize("ending", [".vtk", ".vtp", ".vtu"])
def test_one_vtk_file_may_hold_grains_and_contacts(
    tmp_path: Path, ending: str, vertices: bool
) -> None:
    file = grains_with_lines(tmp_path / f"both{ending}", vertices)
    contacts = scanfab.read(file).contacts
    assert contacts is not None
    assert contacts.source == "file"
    assert contacts.pairs.tolist() == PAIRS.tolist()
    assert scanfab.read(file, contacts="geometric").contacts is None


def test_a_pvd_file_is_a_series_with_times(tmp_path: Path) -> None:
    for step in (100, 200):
        grains_with_lines(tmp_path / f"grains_{step}.vtp")
    box = pyvista.Box().cast_to_unstructured_grid()
    box.save(str(tmp_path / "box_100.vtu"))
    index = tmp_path / "all.pvd"
    index.write_text(
        '<?xml version="1.0"?><VTKFile type="Collection"><Collection>'
        '<DataSet timestep="0.5" file="grains_100.vtp"/>'
        '<DataSet timestep="0.5" file="box_100.vtu"/>'
        '<DataSet timestep="1.5" file="grains_200.vtp"/></Collection></VTKFile>'
    )
    frames = [frame.read() for frame in scanfab.read_series(index)]
    found = [(frame.step, frame.time, len(frame)) for frame in frames]
    assert found == [(100, 0.5, 4), (200, 1.5, 4)]
    index.write_text('<?xml version="1.0"?><VTKFile type="Collection"><Collection><DataSet ')
    with pytest.raises(scanfab.ReadError, match="cannot be read as a list of VTK files"):
        next(iter(scanfab.read_series(index))).read()


def test_standard_input_is_a_series(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    dump = (FLOOR / "multi.txt").read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(dump)))
    code = run(["compute", "-", "--format", "liggghts", *FAST, "--periodic", ""])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    lines = printed.out.splitlines()
    assert len(lines) == 4
    assert all(line.startswith("-,") for line in lines[1:])


def test_standard_input_needs_a_format(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compute", "-"]) == 2
    assert "--format" in capsys.readouterr().err


@pytest.mark.parametrize("again", ["same", "spelt otherwise", "link", "glob"])
def test_a_folder_that_is_named_twice_is_read_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], again: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dumps").mkdir()
    write(tmp_path / "dumps" / "dump_0.txt", dump_text(cubic_rows()))
    (tmp_path / "latest").symlink_to("dumps")
    other = {"same": "dumps", "spelt otherwise": "./dumps/", "link": "latest", "glob": "dum*"}
    assert run(["inspect", "dumps", other[again], "--json"]) == 0
    printed = capsys.readouterr()
    assert [json.loads(line)["source"] for line in printed.out.splitlines()] == ["dumps"]
    said = f"{dict(other, glob='dumps')[again]}: named twice among the sources, and read once"
    assert printed.err.count(said) == 1


def test_a_file_that_is_named_twice_is_one_frame(tmp_path: Path) -> None:
    files = [
        write(tmp_path / f"dump_{step}.txt", dump_text(cubic_rows(), step=step)) for step in (0, 9)
    ]
    with pytest.warns(scanfab.ScanfabWarning, match=r"dump_0.txt: named twice .* read once"):
        series = scanfab.read_series([tmp_path / "dump_*.txt", files[0]])
    assert [frame.step for frame in series] == [0, 9]


def test_a_series_may_start_with_frames_of_boundary_alone(tmp_path: Path) -> None:
    walls = [(1, 2, 5, 0, 0, 0.1), (2, 2, 0, 5, 0, 0.1)]
    grains = [(3, 1, 0, 0, 0, 1), (4, 1, 2, 0, 0, 1), (5, 1, 0, 2, 0, 1)]
    names = "id type x y z radius"
    text = dump_text(walls, names, step=0) + dump_text(walls + grains, names, step=1)
    scan = {"rv": 1.5, "directions": 9, "cutoff": 0, "spacing": 0.1, "variants": "c"}
    series = scanfab.read_series(write(tmp_path / "dump.txt", text))
    table = scanfab.compute(series, boundary="type=2", **scan)
    assert table["grains"].tolist() == [0, 3]
    assert np.isnan(table["alpha_vs"][0])
    assert not np.isnan(table["alpha_vs"][1])


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_the_process_with_its_code(sent: int, code: int, tmp_path: Path) -> None:
    # its first row comes in a moment, its last one in seconds
    series, folder = write_series(tmp_path / "series"), tmp_path / "out"
    folder.mkdir()
    output = folder / "table.csv"
    command = [*PROGRAM, "compute", str(series), "--tolerance", "3e-4", "--workers", "1"]
    with subprocess.Popen(
        [*command, "-o", str(output)],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(folder)},
    ) as process:
        part = Path(f"{output}.part")
        for _ in range(6000):
            if part.exists() and part.stat().st_size > 0:
                break
            time.sleep(0.01)
        process.send_signal(sent)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == code
    assert "Traceback" not in errors
    assert not output.exists()
    assert part.read_text().startswith('{"source"')
    left = {file.name for file in folder.iterdir()}
    assert left == {"table.csv.part", "table.csv.manifest.json.part"}


@pytest.mark.parametrize("name", ["columns", "contacts", "contact_columns", "format"])
def test_a_value_of_another_kind_is_told_by_its_option(name):
    with pytest.raises(SettingsError, match=f"{name}: expected"):
        scanfab.read_series("sample_data", **{name: 3})


@pytest.mark.parametrize("source", [[], 3, [3]])
def test_what_is_no_path_is_told(source):
    with pytest.raises(SettingsError, match="source: expected the path of a folder or file"):
        scanfab.read_series(source)


@pytest.mark.parametrize("read", [scanfab.read, scanfab.read_series])
def test_an_unknown_option_is_told_with_the_nearest(read):
    with pytest.raises(TypeError, match=f"{read.__name__} has no option .*: did you mean 'format'"):
        read("sample_data", formt="yade")

"""The command line as a process: help, version, exit codes, streams."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
YADE = ROOT / "sample_data" / "yade_triaxial"
FAST = ["--directions", "9", "--spacing", "1rmin", "--boundary", "mask=3"]
PROGRAM = [sys.executable, "-c", "from scanfab.cli.main import main; main()"]


def scanfab(*args: str | Path) -> subprocess.CompletedProcess[str]:
    command = [*PROGRAM, *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_help_lists_every_command() -> None:
    answer = scanfab("--help")
    assert answer.returncode == 0
    assert "compute" in answer.stdout
    assert "formats" in answer.stdout


def test_version_is_the_package_s() -> None:
    from importlib.metadata import version

    assert scanfab("--version").stdout == f"scanfab {version('scanfab')}\n"


def test_help_imports_no_heavy_package() -> None:
    code = (
        "import sys; from scanfab.cli.main import run; run(['--help']); "
        "heavy = {'numpy', 'numba', 'scipy', 'pyvista', 'meshio', 'rich', 'matplotlib', 'jinja2', "
        "'polars', 'vtkmodules', 'PIL'} & set(sys.modules); "
        "sys.exit(str(heavy) if heavy else 0)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["--variants", "xyz"], "variants: expected letters out of abcd, found 'xyz'"),
        (["--cutoff", "1foo"], "cutoff: expected a length"),
        (["--spacing", "-1"], "spacing: expected a length above 0"),
        (["--directions", "nonsense:3"], "directions: no rule is called 'nonsense:3'"),
        (["--tolerance", "0"], "tolerance: expected a number above 0"),
        (["--boundary", "mask"], "boundary: expected COLUMN=VALUE"),
        (["--frames", "a:b"], "frames: expected a slice"),
        (["--axis", "0,0,0"], "axis: expected x, y, z or three numbers"),
        (["--strain", "nowhere.csv"], "strain: expected auto, cell, boundary, grains or a CSV"),
        (["--format", "nonsense"], "there is no reader called 'nonsense'"),
        (["--cell", "1", "2"], "--cell: expected three lengths"),
        (["--periodic", "abc"], "--periodic: expected letters out of xyz"),
        (["--columns", "radius"], "--columns: expected NAME=COLUMN"),
        (["-o", "table.docx"], "results can be written as .csv"),
        (["--edge", "share"], "--edge: expected clip, start or ends, found 'share'"),
        (
            ["--rv-shape", "cone"],
            "--rv-shape: expected sphere, box, cylinder, ellipsoid",
        ),
    ],
)
def test_wrong_usage_is_exit_code_2_and_one_message(
    args: list[str], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """In this process; one that ends with this code is that of the missing source."""
    from scanfab.cli.main import run

    assert run(["compute", str(YADE), *args]) == 2
    said = capfd.readouterr()
    assert message in said.err
    assert said.out == ""
    assert "Traceback" not in said.err


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("computee", "No such command 'computee'. Did you mean 'compute'?"),
        ("nonsense", "No such command 'nonsense'. Choose from compute, merge, compare, inspect"),
    ],
)
def test_a_command_that_does_not_exist_gets_a_suggestion(
    word: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from scanfab.cli.main import run

    assert run([word]) == 2
    assert hint in capsys.readouterr().err


def test_missing_source_is_wrong_usage() -> None:
    answer = scanfab("compute", "nowhere")
    assert answer.returncode == 2
    assert "nowhere" in answer.stderr
    assert answer.stdout == ""
    assert "Traceback" not in answer.stderr


def test_unreadable_source_is_exit_code_1(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing\n")
    answer = scanfab("compute", tmp_path)
    assert answer.returncode == 1
    assert answer.stderr.startswith("scanfab: error: ")
    assert "no reader knows the format" in answer.stderr
    assert answer.stdout == ""


def test_debug_shows_the_traceback(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing\n")
    assert "Traceback" in scanfab("--debug", "compute", tmp_path).stderr


def test_results_go_to_standard_output_and_words_to_standard_error() -> None:
    answer = scanfab("compute", YADE, "--frames", "0", *FAST)
    assert answer.returncode == 0
    lines = answer.stdout.splitlines()
    assert lines[0].startswith("source,frame,step,time,strain,variant,grains")
    assert len(lines) == 5
    assert "skipped" in answer.stderr
    assert "\x1b" not in answer.stdout + answer.stderr


def test_no_void_fabric_in_any_row_is_exit_code_1() -> None:
    answer = scanfab("compute", YADE, "--frames", "0", "--cutoff", "1.0", *FAST)
    assert answer.returncode == 1
    assert "no void segment reaches the cut-off" in answer.stderr
    assert "nan" not in answer.stdout.lower()


def test_output_file_is_complete_or_untouched(tmp_path: Path) -> None:
    output = tmp_path / "table.csv"
    output.write_text("precious\n")
    assert scanfab("compute", YADE, "--rv", "-1", "-o", output).returncode == 2
    assert output.read_text() == "precious\n"
    done = scanfab("compute", YADE, "--frames", "0", "-o", output, *FAST)
    assert done.returncode == 0
    assert len(output.read_text().splitlines()) == 5
    assert {path.name for path in tmp_path.iterdir()} == {"table.csv", "table.csv.manifest.json"}


def test_cell_takes_three_or_six_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import pyvista

    from scanfab.cli.main import run

    dump = tmp_path / "spheres.vtk"
    cloud = pyvista.PolyData([[1.0, 1, 1], [3, 3, 3]])
    cloud["radius"] = [1.0, 1.0]
    cloud.save(str(dump))
    tables = []
    for cell in (["4", "4", "4"], ["4", "4", "4", "1", "0", "0"]):
        assert run(["compute", "--cell", *cell, str(dump), "--variants", "c", *FAST[:4]]) == 0
        tables.append(capsys.readouterr().out)
    assert [len(table.splitlines()) for table in tables] == [2, 2]
    assert tables[0] != tables[1]


def test_a_closed_pipe_ends_quietly() -> None:
    command = [*PROGRAM, "compute", str(YADE), *FAST]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        errors = process.stderr.read()
    assert "Traceback" not in errors
    assert "Broken" not in errors


def test_interrupt_is_exit_code_130(monkeypatch: pytest.MonkeyPatch) -> None:
    from scanfab.cli import group, main

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(group.cli, "main", interrupted)
    assert main.run(["compute"]) == 130


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
@pytest.mark.parametrize(
    ("sent", "code", "word"), [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated")]
)
def test_a_signal_during_an_import_ends_the_process_at_once(tmp_path, sent, code, word):
    """Whatever is imported need not pass an exception on: some extension modules crash instead."""
    (tmp_path / "deaf.py").write_text(
        "import os, signal, time\n"
        "try:\n"
        f"    os.kill(os.getpid(), signal.{sent})\n"
        "    time.sleep(60)\n"
        "except BaseException:\n"
        "    raise SystemExit('an exception came here')\n"
    )
    program = (
        # a shell's background jobs ignore SIGINT
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from scanfab.cli import main; main.run = lambda args: __import__('deaf'); main.main()"
    )
    answer = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert answer.returncode == code
    assert answer.stderr == f"scanfab: {word}\n"

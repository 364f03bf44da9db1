"""The command line as a process: help, version, exit codes, streams."""

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from scanfab.base.errors import ReadError
from scanfab.cli import group, main
from tests.helpers.interruptions import PROGRAM
from tests.helpers.truth import TRIAXIAL

FAST = ["--directions", "9", "--spacing", "1rmin", "--boundary", "mask=3", "--variants", "a"]


def test_version_is_the_package_s(ask) -> None:
    assert ask("--version").out == f"scanfab {version('scanfab')}\n"


def test_help_lists_every_command_and_like_version_imports_no_heavy_package() -> None:
    code = (
        "import sys; from scanfab.cli.main import run; run(['--help']); run(['--version']); "
        "heavy = {'numpy', 'numba', 'scipy', 'pyvista', 'meshio', 'rich', 'matplotlib', 'jinja2', "
        "'polars', 'vtkmodules', 'PIL'} & set(sys.modules); "
        "sys.exit(str(heavy) if heavy else 0)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stderr
    for command in group.COMMANDS:
        assert f"\n  {command} " in answer.stdout


def test_debug_shows_why(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="the folder holds no files"):
        main.run(["compute", str(tmp_path), "--debug"])


def test_a_closed_pipe_ends_quietly() -> None:
    command = [*PROGRAM, "compute", str(TRIAXIAL), *FAST]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        errors = process.stderr.read()
    assert "Traceback" not in errors
    assert "Broken" not in errors

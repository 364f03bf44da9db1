"""Bash completes the command line by the line of its page."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from scanfab.cli.group import cli

ROOT = Path(__file__).parents[2]
# what is typed before the Tab key, and what bash makes of it: a command, and a word of an option
# that takes files as well
TYPED = {"scanfab sam": "sample-data", "scanfab compute --strain cel": "cell"}
ASK = """
COMP_WORDS=({})
COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
COMPREPLY=()
_scanfab_completion scanfab
echo "${{COMPREPLY[@]}}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="the line is for bash")
def test_bash_completes_by_the_line_of_the_page(monkeypatch) -> None:
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^eval .*=bash_source scanfab.*$", page, re.M)
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    words = ["bash", "-c", line + "".join(map(ASK.format, TYPED))]
    assert subprocess.check_output(words, text=True).split() == [*TYPED.values()]


COMPLETED = [
    ("co", "plain,compute plain,compare plain,convert"),
    ("compare --figure ev", "plain,evolution"), ("compute --strain ce", "plain,cell file,ce"),
    ("compute --on-error ", "plain,stop plain,skip"),
    ("inspect --format l", "plain,lammps plain,liggghts plain,lf-dem"),
    ("compute --figure ro", "plain,rose"), ("compute --directions le", "plain,lebedev:"),
    ("compute --directions equal-angle:", "plain,equal-angle:"),
    ("compare --summary --fields slope_o", "plain,slope_origin"),
    ("compute --fields frame,alpha_c_axial_se", "plain,frame,alpha_c_axial_se"),
    ("view --axis ", "plain,x plain,y plain,z"),
]  # fmt: skip


@pytest.mark.parametrize(("typed", "found"), COMPLETED)
def test_commands_and_choices_are_completed(typed, found):
    complete = ShellComplete(cli, {}, "scanfab", "_SCANFAB_COMPLETE")
    *words, current = typed.split(" ")
    offered = complete.get_completions(words, current)
    assert {f"{one.type},{one.value}" for one in offered} == set(found.split())

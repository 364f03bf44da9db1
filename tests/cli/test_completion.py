"""Shells complete the command line by the lines of its page."""

import os
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from scanfab.cli.group import cli

ROOT = Path(__file__).parents[2]
# what is typed before the Tab key, and what the shell makes of it: a command, an option, a word
# of an option, and a word of an option that takes files as well
TYPED = {
    "scanfab sam": "sample-data",
    "scanfab compute --rattl": "--rattlers",
    "scanfab compute --rattlers rec": "recursive",
    "scanfab compute --strain cel": "cell",
}
INTERACTIVE = {"bash": ["bash", "--norc", "-i"], "zsh": ["zsh", "-f", "-i"]}


def scripted(shell: str) -> str:
    """The line of the page on the command line that makes a shell complete."""
    page = (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8")
    pattern = rf"^.*_SCANFAB_COMPLETE={shell}_source scanfab(?:\).*| \| .*)$"
    (line,) = re.findall(pattern, page, re.M)
    return f"autoload -Uz compinit; compinit -u -D; {line}" if shell == "zsh" else line


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_by_the_line_of_the_page(shell: str, tmp_path: Path) -> None:
    scripts = Path(sys.executable).parent
    if shutil.which(shell) is None or not (scripts / "scanfab").exists():
        pytest.skip(f"{shell} or the command scanfab is not installed")
    path = f"{scripts}{os.pathsep}{os.environ['PATH']}"
    env = {**os.environ, "PATH": path, "TERM": "xterm", "HOME": str(tmp_path)}
    if shell == "fish":
        asked = "\n".join(f"complete -C '{typed}'" for typed in TYPED)
        words = ["fish", "--no-config", "-c", f"{scripted(shell)}\n{asked}"]
        done = subprocess.run(words, env=env, capture_output=True, text=True, check=False)
        assert [line.split("\t")[0] for line in done.stdout.splitlines()] == [*TYPED.values()]
        return
    ours, theirs = os.openpty()
    streams = dict.fromkeys(("stdin", "stdout", "stderr"), theirs)
    words = INTERACTIVE[shell]
    with subprocess.Popen(words, env=env, start_new_session=True, **streams) as process:
        try:
            os.write(ours, f"{scripted(shell)}; echo rea''dy\n".encode())
            read_until(ours, "ready")
            for typed, completed in TYPED.items():
                os.write(ours, f"{typed}\t".encode())
                read_until(ours, completed)
                os.write(ours, b"\x15")  # Ctrl-U empties the line
        finally:
            process.kill()
            os.close(ours)
            os.close(theirs)


def read_until(terminal: int, words: str) -> None:
    """Read what a shell writes to its terminal until these words come, for some seconds at most."""
    seen, end = "", time.monotonic() + 60
    while words not in seen:
        assert select.select([terminal], [], [], end - time.monotonic())[0], (words, seen)
        seen += os.read(terminal, 4096).decode("utf-8", "replace")


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

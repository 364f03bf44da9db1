"""Write the outputs of the pages: run the commands of each page in turn, in a folder of its own."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from figures import DOCS, workplace

from scanfab.cli.main import run

# a call of scanfab by itself, whether its errors go the same way, and what reads what it prints
CALL = re.compile(r"scanfab ((?:'[^']*'|[^'|;&<>$*])*)(2>&1 )?(?:\| (.*))?")
# a loop of bash over words
LOOP = re.compile(r"for (\w+) in ([\w ]+); do +(.*); done")
BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(block: str) -> list[str]:
    """The lines behind a $ sign, with the lines that they go on in behind a backslash."""
    return re.findall(r"^\$ ((?:.*\\\n)*.*)$", block, re.MULTILINE)


def with_outputs(block: re.Match[str]) -> str:
    """A block of commands, each with what it prints."""
    parts = [f"$ {command}\n{output_of(command)}" for command in commands(block[1])]
    return "```console\n" + "".join(parts) + "```"


def output_of(command: str) -> str:
    """
    What a command prints.

    A call of scanfab runs in this process, which has loaded the kernels and libraries, and bash
    pipes what it prints through further programs. So do the calls in a loop. Other lines are for
    bash as they stand.
    """
    line = command.replace("\\\n", "")
    if loop := LOOP.fullmatch(line):
        name, words, body = loop.groups()
        return "".join(output_of(body.replace(f"${name}", word)) for word in words.split())
    call = CALL.fullmatch(line)
    if call is None:
        output = in_bash(command)
    else:
        printed, errors = StringIO(), StringIO()
        words, is_joined, reader = call.groups()
        is_joined = is_joined or not reader
        with redirect_stdout(printed), redirect_stderr(printed if is_joined else errors):
            run(shlex.split(words))
        output = printed.getvalue()
        if reader:
            output = errors.getvalue() + in_bash(reader, output)
    # said once on each machine
    return re.sub(r"^scanfab: compiling .*\n", "", output, flags=re.MULTILINE)


def in_bash(command: str, given: str = "") -> str:
    """What a command for bash prints on both streams, if it reads a text."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["bash", "-c", command],
        env={**os.environ, "PATH": path},
        input=given,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    ).stdout


def pages() -> list[Path]:
    """The pages that show what commands print."""
    return [
        page
        for page in sorted(DOCS.rglob("*.md"))
        if BLOCK.search(page.read_text(encoding="utf-8"))
    ]


def fresh_page(page: Path) -> str:
    """The page as it should be."""
    with workplace(), patch.dict(os.environ, COLUMNS="100"):
        return BLOCK.sub(with_outputs, page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    for named in [Path(name).resolve() for name in sys.argv[1:]] or pages():
        named.write_text(fresh_page(named), encoding="utf-8")

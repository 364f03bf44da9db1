"""Write the outputs of the pages: run the commands of each page in turn, in a folder of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from figures import DOCS, workplace

BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(block: str) -> list[str]:
    """The lines behind a $ sign, with the lines that they go on in behind a backslash."""
    return re.findall(r"^\$ ((?:.*\\\n)*.*)$", block, re.MULTILINE)


def with_outputs(block: re.Match[str]) -> str:
    """A block of commands, each with what it prints."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    parts = []
    for command in commands(block[1]):
        done = subprocess.run(
            ["bash", "-c", command],
            env={**os.environ, "PATH": path, "COLUMNS": "100"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        # said once on each machine
        output = re.sub(r"^scanfab: compiling .*\n", "", done.stdout, flags=re.MULTILINE)
        parts.append(f"$ {command}\n{output}")
    return "```console\n" + "".join(parts) + "```"


def pages() -> list[Path]:
    """The pages that show what commands print."""
    return [
        page
        for page in sorted(DOCS.rglob("*.md"))
        if BLOCK.search(page.read_text(encoding="utf-8"))
    ]


def fresh_page(page: Path) -> str:
    """The page as it should be."""
    with workplace():
        return BLOCK.sub(with_outputs, page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    for named in [Path(name).resolve() for name in sys.argv[1:]] or pages():
        named.write_text(fresh_page(named), encoding="utf-8")

"""Write the outputs of docs/tutorial.md: run its commands in turn, in a folder of their own."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "tutorial.md"
BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(block: str) -> list[str]:
    """The lines behind a $ sign, with the lines that they go on in."""
    return [
        match[1].replace("\\\n> ", "\\\n")
        for match in re.finditer(r"^\$ (.*(?:\\\n> .*)*)$", block, re.MULTILINE)
    ]


def page_with_outputs(page: str, folder: Path) -> str:
    """The page with the outputs that its commands have in this folder."""
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "COLUMNS": "100",
    }

    def run(match: re.Match[str]) -> str:
        parts = []
        for command in commands(match[1]):
            done = subprocess.run(
                ["bash", "-c", command],
                cwd=folder,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                check=False,
            )
            shown = command.replace("\\\n", "\\\n> ")
            # said once on each machine
            output = re.sub(r"^scanfab: compiling .*\n", "", done.stdout, flags=re.MULTILINE)
            parts.append(f"$ {shown}\n{output}")
        return "```console\n" + "".join(parts) + "```"

    return BLOCK.sub(run, page)


def fresh_page() -> str:
    """The page as it should be."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "sample_data", Path(folder) / "sample_data")
        return page_with_outputs(PAGE.read_text(encoding="utf-8"), Path(folder))


if __name__ == "__main__":
    PAGE.write_text(fresh_page(), encoding="utf-8")

"""Write the outputs of the pages: run the commands of each page in turn, in a folder of its own."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(block: str) -> list[str]:
    """The lines behind a $ sign, with the lines that they go on in behind a backslash."""
    return re.findall(r"^\$ ((?:.*\\\n)*.*)$", block, re.MULTILINE)


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
            # said once on each machine
            output = re.sub(r"^scanfab: compiling .*\n", "", done.stdout, flags=re.MULTILINE)
            parts.append(f"$ {command}\n{output}")
        return "```console\n" + "".join(parts) + "```"

    return BLOCK.sub(run, page)


def pages() -> list[Path]:
    """The pages that show what commands print."""
    return [
        page
        for page in sorted(DOCS.rglob("*.md"))
        if BLOCK.search(page.read_text(encoding="utf-8"))
    ]


def fresh_page(page: Path) -> str:
    """The page as it should be."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "sample_data", Path(folder) / "sample_data")
        return page_with_outputs(page.read_text(encoding="utf-8"), Path(folder))


if __name__ == "__main__":
    for named in [Path(name).resolve() for name in sys.argv[1:]] or pages():
        named.write_text(fresh_page(named), encoding="utf-8")

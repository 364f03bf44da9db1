"""Draw the rooms of the package in docs/architecture.md from the code: files, imports, floors."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "scanfab"
PAGE = Path(__file__).parent / "architecture.md"
BEGIN, END = "<!-- rooms -->", "<!-- end of rooms -->"


def rooms() -> list[str]:
    """The rooms, the highest first; those of a floor by name."""
    names = [folder.name for folder in PACKAGE.iterdir() if (folder / "__init__.py").is_file()]
    return sorted(names, key=lambda name: (-floor(name), name))


def files(room: str) -> list[Path]:
    """The modules of a room, its folders last."""
    found = [path for path in (PACKAGE / room).rglob("*.py") if path.name != "__init__.py"]
    return sorted(found, key=lambda path: (len(path.parts), path))


@cache
def arrows(room: str) -> frozenset[str]:
    """The other rooms that a room imports, anywhere in its files."""
    found = set()
    for path in (PACKAGE / room).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("scanfab."):
                found.add(str(node.module).split(".")[1])
    return frozenset(found - {room})


@cache
def floor(room: str) -> int:
    """One more than the highest floor that a room stands on."""
    return 1 + max((floor(other) for other in arrows(room)), default=0)


def purpose(path: Path) -> str:
    """The first sentence of a module."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n", 1)[0].split()).rstrip(".")


def drawing() -> str:
    """The floors, and what each room imports."""
    lines = []
    for room in rooms():
        below = [other for other in rooms() if other in arrows(room)]
        lines.append(
            f"{floor(room)}  {room:<9} {'-> ' + ', '.join(below) if below else ''}".rstrip()
        )
    return "\n".join(lines)


def section() -> str:
    """What stands between the marks of the page."""
    count = sum(len(arrows(room)) for room in rooms())
    text = f"{len(rooms())} rooms on {max(map(floor, rooms()))} floors, {count} arrows:\n\n"
    text += f"```text\n{drawing()}\n```\n"
    for room in rooms():
        text += f"\n### {room}\n\n{purpose(PACKAGE / room / '__init__.py')}.\n\n"
        text += "| file | what it holds |\n|---|---|\n"
        for path in files(room):
            name = path.relative_to(PACKAGE / room).as_posix()
            text += f"| `{name}` | {purpose(path)} |\n"
    return text


def page() -> str:
    """The page with its section of today."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN + "\n")
    return f"{before}{BEGIN}\n{section()}{END}\n{rest.split(END + chr(10))[1]}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

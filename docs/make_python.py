"""Write the list of public names in docs/python.md from their docstrings."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import scanfab

PAGE = Path(__file__).parent / "python.md"
BEGIN, END = "<!-- names -->", "<!-- end of names -->"

# in the order in which a computation needs them
GROUPS = {
    "Reading and writing": ("read", "read_series", "follow_series", "Series", "Frame", "convert"),
    "Packings from anywhere": ("Packing", "Cell", "ContactList", "Contacts", "find_contacts"),
    "Computing": (
        "compute", "compute_file", "dask_executor", "fabric_map", "Settings",
        "calibrate", "Calibration",
    ),
    "Tables": (
        "Table", "Row", "load", "read_rows", "merge_tables", "compare_tables", "Comparison",
        "COLUMNS", "Column",
    ),
    "Figures and reports": ("scan_frames", "ScannedFrames", "make_report", "Report"),
    "Scanning by hand": (
        "samples", "Sample", "Window", "sphere", "box", "cylinder", "ellipsoid", "polyhedron",
        "Convex", "solids_of", "Solids", "direction_rule", "DirectionRule", "scan_lines",
        "ScanSums", "void_fabric", "VoidFabric", "contact_fabric", "FabricTensor",
    ),
    "Errors and warnings": (
        "ScanfabError", "ReadError", "UnknownFormatError", "NoFrameError", "PackingError",
        "SettingsError", "ScanfabWarning", "ScanfabNote",
    ),
}  # fmt: skip


def summary(name: str) -> str:
    """The first sentence of a docstring; of a constant, that it is one."""
    named = getattr(scanfab, name)
    if not (inspect.isclass(named) or callable(named)):
        return "The names of the columns of every fabric table, in their order."
    text = " ".join((inspect.getdoc(named) or "").split("\n\n")[0].split())
    return re.sub(r":\w+:`(?:scanfab\.)?([^`]*)`", r"`\1`", text.replace("``", "`"))


def names() -> str:
    """The tables of names."""
    tables = [
        f"### {title}\n\n| name | what it is |\n|---|---|\n"
        + "".join(f"| `{name}` | {summary(name)} |\n" for name in group)
        for title, group in GROUPS.items()
    ]
    return "\n".join(tables)


def page() -> str:
    """The page with its names of today."""
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN + "\n")
    return f"{before}{BEGIN}\n{names()}{END}\n{rest.split(END + chr(10))[1]}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

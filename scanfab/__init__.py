"""The void fabric of granular packings by scan lines: the public names, loaded when used."""

from __future__ import annotations

# as typing has it, which takes longer to load than all that is needed to answer Ctrl-C
TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any

    from scanfab.base.column import Column
    from scanfab.base.convex import Convex
    from scanfab.base.errors import (
        NoFrameError,
        PackingError,
        ReadError,
        ScanfabError,
        ScanfabNote,
        ScanfabWarning,
        SettingsError,
        UnknownFormatError,
    )
    from scanfab.base.shapes import box, cylinder, ellipsoid, polyhedron, sphere
    from scanfab.fabric.contact import contact_fabric
    from scanfab.fabric.tensor import FabricTensor
    from scanfab.fabric.void import VoidFabric, void_fabric
    from scanfab.io.convert import convert
    from scanfab.io.follow import follow_series
    from scanfab.io.frame import Frame
    from scanfab.io.series import Series
    from scanfab.io.sources import read, read_series
    from scanfab.packing.cell import Cell
    from scanfab.packing.contacts import ContactList, Contacts
    from scanfab.packing.packing import Packing
    from scanfab.packing.sample import Sample
    from scanfab.packing.search import find_contacts
    from scanfab.packing.window import Window
    from scanfab.pipeline.calibration import Calibration, calibrate
    from scanfab.pipeline.cluster import dask_executor
    from scanfab.pipeline.compute import compute
    from scanfab.pipeline.frames import samples
    from scanfab.pipeline.maps.fabric_map import fabric_map
    from scanfab.pipeline.measurement import solids_of
    from scanfab.pipeline.merge import merge_tables
    from scanfab.pipeline.settings import Settings
    from scanfab.scan.directions import DirectionRule, direction_rule
    from scanfab.scan.scan import ScanSums, scan_lines
    from scanfab.scan.solids import Solids
    from scanfab.table.columns import COLUMNS
    from scanfab.table.compare import Comparison, compare_tables
    from scanfab.table.formats import read_rows
    from scanfab.table.row import Row
    from scanfab.table.table import Table, load
    from scanfab.viz.compute_file import compute_file
    from scanfab.viz.report.report import Report, make_report
    from scanfab.viz.scanned_frames import ScannedFrames, scan_frames

# numpy, numba and the readers are loaded by the first name that needs them
_HOME = {
    "COLUMNS": "table.columns",
    "Calibration": "pipeline.calibration",
    "Cell": "packing.cell",
    "Column": "base.column",
    "Comparison": "table.compare",
    "ContactList": "packing.contacts",
    "Contacts": "packing.contacts",
    "Convex": "base.convex",
    "DirectionRule": "scan.directions",
    "FabricTensor": "fabric.tensor",
    "Frame": "io.frame",
    "NoFrameError": "base.errors",
    "Packing": "packing.packing",
    "PackingError": "base.errors",
    "ReadError": "base.errors",
    "Report": "viz.report.report",
    "Row": "table.row",
    "Sample": "packing.sample",
    "ScanSums": "scan.scan",
    "ScanfabError": "base.errors",
    "ScanfabNote": "base.errors",
    "ScanfabWarning": "base.errors",
    "ScannedFrames": "viz.scanned_frames",
    "Series": "io.series",
    "Settings": "pipeline.settings",
    "SettingsError": "base.errors",
    "Solids": "scan.solids",
    "Table": "table.table",
    "UnknownFormatError": "base.errors",
    "VoidFabric": "fabric.void",
    "Window": "packing.window",
    "box": "base.shapes",
    "calibrate": "pipeline.calibration",
    "compare_tables": "table.compare",
    "compute": "pipeline.compute",
    "compute_file": "viz.compute_file",
    "convert": "io.convert",
    "contact_fabric": "fabric.contact",
    "cylinder": "base.shapes",
    "dask_executor": "pipeline.cluster",
    "direction_rule": "scan.directions",
    "ellipsoid": "base.shapes",
    "fabric_map": "pipeline.maps.fabric_map",
    "find_contacts": "packing.search",
    "follow_series": "io.follow",
    "load": "table.table",
    "make_report": "viz.report.report",
    "merge_tables": "pipeline.merge",
    "polyhedron": "base.shapes",
    "read": "io.sources",
    "read_rows": "table.formats",
    "read_series": "io.sources",
    "samples": "pipeline.frames",
    "scan_frames": "viz.scanned_frames",
    "scan_lines": "scan.scan",
    "solids_of": "pipeline.measurement",
    "sphere": "base.shapes",
    "void_fabric": "fabric.void",
}

__all__ = [
    "COLUMNS",
    "Calibration",
    "Cell",
    "Column",
    "Comparison",
    "ContactList",
    "Contacts",
    "Convex",
    "DirectionRule",
    "FabricTensor",
    "Frame",
    "NoFrameError",
    "Packing",
    "PackingError",
    "ReadError",
    "Report",
    "Row",
    "Sample",
    "ScanSums",
    "ScanfabError",
    "ScanfabNote",
    "ScanfabWarning",
    "ScannedFrames",
    "Series",
    "Settings",
    "SettingsError",
    "Solids",
    "Table",
    "UnknownFormatError",
    "VoidFabric",
    "Window",
    "box",
    "calibrate",
    "compare_tables",
    "compute",
    "compute_file",
    "contact_fabric",
    "convert",
    "cylinder",
    "dask_executor",
    "direction_rule",
    "ellipsoid",
    "fabric_map",
    "find_contacts",
    "follow_series",
    "load",
    "make_report",
    "merge_tables",
    "polyhedron",
    "read",
    "read_rows",
    "read_series",
    "samples",
    "scan_frames",
    "scan_lines",
    "solids_of",
    "sphere",
    "void_fabric",
]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name == "__version__":
        from importlib.metadata import version

        return version("scanfab")
    if name not in _HOME:
        raise AttributeError(f"module 'scanfab' has no attribute {name!r}")
    return getattr(import_module(f"scanfab.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

"""The void fabric of granular packings by scan lines: the public names, loaded when used."""

from __future__ import annotations

# same as typing.TYPE_CHECKING; importing typing here would delay the answer to Ctrl-C. Jedi, which
# completes names in notebooks and editors, skips the block below if the type is not written out.
TYPE_CHECKING: bool = False

if TYPE_CHECKING:
    # for editors and type checkers: "as" says that a name is public
    from typing import Any

    from scanfab.base.column import Column as Column
    from scanfab.base.convex import Convex as Convex
    from scanfab.base.errors import NoFrameError as NoFrameError
    from scanfab.base.errors import PackingError as PackingError
    from scanfab.base.errors import ReadError as ReadError
    from scanfab.base.errors import ScanfabError as ScanfabError
    from scanfab.base.errors import ScanfabNote as ScanfabNote
    from scanfab.base.errors import ScanfabWarning as ScanfabWarning
    from scanfab.base.errors import SettingsError as SettingsError
    from scanfab.base.errors import UnknownFormatError as UnknownFormatError
    from scanfab.base.shapes import box as box
    from scanfab.base.shapes import cylinder as cylinder
    from scanfab.base.shapes import ellipsoid as ellipsoid
    from scanfab.base.shapes import polyhedron as polyhedron
    from scanfab.base.shapes import sphere as sphere
    from scanfab.fabric.tensor import FabricTensor as FabricTensor
    from scanfab.fabric.tensor import contact_fabric as contact_fabric
    from scanfab.fabric.void import VoidFabric as VoidFabric
    from scanfab.fabric.void import void_fabric as void_fabric
    from scanfab.io.convert import convert as convert
    from scanfab.io.follow import follow_series as follow_series
    from scanfab.io.frame import Frame as Frame
    from scanfab.io.series import Series as Series
    from scanfab.io.sources import read as read
    from scanfab.io.sources import read_series as read_series
    from scanfab.packing.cell import Cell as Cell
    from scanfab.packing.contacts import ContactList as ContactList
    from scanfab.packing.contacts import Contacts as Contacts
    from scanfab.packing.packing import Packing as Packing
    from scanfab.packing.sample import Sample as Sample
    from scanfab.packing.search import find_contacts as find_contacts
    from scanfab.packing.window import Window as Window
    from scanfab.pipeline.calibration import Calibration as Calibration
    from scanfab.pipeline.calibration import calibrate as calibrate
    from scanfab.pipeline.cluster import dask_executor as dask_executor
    from scanfab.pipeline.compute import compute as compute
    from scanfab.pipeline.compute import fabric_map as fabric_map
    from scanfab.pipeline.frames import samples as samples
    from scanfab.pipeline.inside import from_ovito as from_ovito
    from scanfab.pipeline.inside import from_yade as from_yade
    from scanfab.pipeline.inside import ovito_modifier as ovito_modifier
    from scanfab.pipeline.inspection import inspect as inspect
    from scanfab.pipeline.measurement import solids_of as solids_of
    from scanfab.pipeline.merge import merge_tables as merge_tables
    from scanfab.pipeline.settings import Settings as Settings
    from scanfab.scan.directions import DirectionRule as DirectionRule
    from scanfab.scan.directions import direction_rule as direction_rule
    from scanfab.scan.scan import ScanSums as ScanSums
    from scanfab.scan.scan import scan_lines as scan_lines
    from scanfab.scan.solids import Solids as Solids
    from scanfab.table.columns import COLUMNS as COLUMNS
    from scanfab.table.compare import Comparison as Comparison
    from scanfab.table.compare import compare_tables as compare_tables
    from scanfab.table.formats import read_rows as read_rows
    from scanfab.table.row import Row as Row
    from scanfab.table.table import Table as Table
    from scanfab.table.table import load as load
    from scanfab.viz.compute_file import compute_file as compute_file
    from scanfab.viz.report.report import Report as Report
    from scanfab.viz.report.report import report as report
    from scanfab.viz.scanned_frames import ScannedFrames as ScannedFrames
    from scanfab.viz.scanned_frames import scan_frames as scan_frames

# the modules of the public names; each is loaded, with numpy, numba or readers, by its first name
_NAMES = {
    "base.column": ["Column"],
    "base.convex": ["Convex"],
    "base.errors": [
        "NoFrameError",
        "PackingError",
        "ReadError",
        "ScanfabError",
        "ScanfabNote",
        "ScanfabWarning",
        "SettingsError",
        "UnknownFormatError",
    ],
    "base.shapes": ["box", "cylinder", "ellipsoid", "polyhedron", "sphere"],
    "fabric.tensor": ["FabricTensor", "contact_fabric"],
    "fabric.void": ["VoidFabric", "void_fabric"],
    "io.convert": ["convert"],
    "io.follow": ["follow_series"],
    "io.frame": ["Frame"],
    "io.series": ["Series"],
    "io.sources": ["read", "read_series"],
    "packing.cell": ["Cell"],
    "packing.contacts": ["ContactList", "Contacts"],
    "packing.packing": ["Packing"],
    "packing.sample": ["Sample"],
    "packing.search": ["find_contacts"],
    "packing.window": ["Window"],
    "pipeline.calibration": ["Calibration", "calibrate"],
    "pipeline.cluster": ["dask_executor"],
    "pipeline.compute": ["compute", "fabric_map"],
    "pipeline.frames": ["samples"],
    "pipeline.inside": ["from_ovito", "from_yade", "ovito_modifier"],
    "pipeline.inspection": ["inspect"],
    "pipeline.measurement": ["solids_of"],
    "pipeline.merge": ["merge_tables"],
    "pipeline.settings": ["Settings"],
    "scan.directions": ["DirectionRule", "direction_rule"],
    "scan.scan": ["ScanSums", "scan_lines"],
    "scan.solids": ["Solids"],
    "table.columns": ["COLUMNS"],
    "table.compare": ["Comparison", "compare_tables"],
    "table.formats": ["read_rows"],
    "table.row": ["Row"],
    "table.table": ["Table", "load"],
    "viz.compute_file": ["compute_file"],
    "viz.report.report": ["Report", "report"],
    "viz.scanned_frames": ["ScannedFrames", "scan_frames"],
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}

__all__ = sorted(_HOME)


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

"""Computed frames as ParaView files: which kinds there are, and what each holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import mean_length_function, sphere_points
from scanfab.fabric.tensor import COMPONENTS
from scanfab.packing.sample import VARIANTS
from scanfab.packing.window import Window
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.settings import Settings, Vector
from scanfab.scan.lines import line_triads
from scanfab.scan.segments import Segments, sample_segments
from scanfab.table.reading import number_of
from scanfab.table.table import Row
from scanfab.viz import vtk_files as vtk
from scanfab.viz.scene import contact_lines, grains_of

__all__ = ["VtkFolder", "scan_line_sample", "vtk_folders"]


LINES = 120
TEXT_FIELDS = ("source", "variant", "contacts_from")


class VtkFolder:
    """
    A folder of ParaView files, to be called with each computed frame of one series.

    Parameters
    ----------
    folder : Path
        Is made if it does not exist.
    axis : tuple of float
        Loading axis, along which half of the scan lines run.
    go_on : bool, optional
        Keep the frames of an earlier run in the collections.

    Raises
    ------
    SettingsError
        If the folder cannot be made or written to.
    """

    def __init__(self, folder: Path, axis: Vector, go_on: bool = False) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SettingsError(f"vtk: {folder} cannot be made: {error.strerror}") from None
        check_folder(folder / "grains.pvd")
        self.folder = folder
        self.axis = axis
        self.go_on = go_on
        self._collections: dict[str, vtk.Collection] = {}
        # frames come from several threads, and VTK is not made for that
        self._lock = Lock()

    def __call__(self, result: FrameResult) -> None:
        """Write all files of a frame."""
        with self._lock:
            windows = {_name("window", rv): one for rv, one in _windows(result)}
            # of several RVs the largest, which holds the others
            window = [None, *windows.values()][-1]
            fields = _fields(result.rows)
            self._save("grains", vtk.grain_mesh(grains_of(result.sample, window)), result, fields)
            contacts = vtk.contact_mesh(contact_lines(result.sample, window))
            self._save("contacts", contacts, result, fields)
            for name, one in windows.items():
                surface = vtk.window_mesh(one.center, one.shape)
                self._save(name, surface, result, fields)
            for row in result.rows:
                self._save_variant(result, row)

    def _save_variant(self, result: FrameResult, row: Row) -> None:
        fields = _fields([row])
        if not result.measurements:
            return
        rv = number_of(row, "rv")
        measured, name = result.measured(row.variant, rv), _name(row.variant, rv)
        center = measured.solids.origin
        lines = scan_line_sample(measured, row.variant, self.axis)
        mesh = vtk.line_mesh(lines, measured.plan.cutoff)
        self._save(f"lines-{name}", mesh, result, fields)
        function = mean_length_function(measured.sums.axes, *measured.kept(row.variant))
        if function is not None and row.alpha_vs is not None:
            points, weights = sphere_points()
            surface = vtk.distribution_mesh(points, function(points), weights)
            self._save(f"distribution-{name}", surface, result, fields)
        tensors = _tensors(row)
        if tensors:
            size = 0.3 * _reach(result)
            mesh = vtk.ellipsoid_mesh(tensors, center, size)
            self._save(f"ellipsoids-{name}", mesh, result, fields)
            mesh = vtk.tensor_points(tensors, center)
            self._save(f"tensors-{name}", mesh, result, fields)

    def _save(self, kind: str, mesh: Any, result: FrameResult, fields: Mapping[str, Any]) -> None:
        file = f"{kind}_{result.number:06d}.vtp"
        vtk.save_mesh(mesh, self.folder / file, fields)
        if kind not in self._collections:
            path = self.folder / f"{kind}.pvd"
            self._collections[kind] = vtk.Collection(path, self.go_on)
        self._collections[kind].add(file, _time(result))


def vtk_folders(folder: Path, count: int, settings: Settings, go_on: bool) -> list[VtkFolder]:
    """
    The folders of so many series; if there are several, each has its own in the one.

    Raises
    ------
    SettingsError
        If a folder cannot be made or written to, or if there are several cut-offs.
    """
    if settings.cutoffs:
        raise SettingsError("vtk: files for ParaView are of one cut-off: leave out `cutoffs`")
    own = [folder / f"series-{number}" for number in range(1, count + 1)]
    return [VtkFolder(one, settings.axis, go_on) for one in (own if count > 1 else [folder])]


def _windows(result: FrameResult) -> Iterator[tuple[float | None, Window]]:
    """The RVs of a frame with their sizes, if there are several to be told apart."""
    for measured in result.measurements:
        for rv in measured.plan.rvs[:1]:
            if rv.window is not None:
                yield rv.fraction, rv.window


def _name(kind: str, rv: float | None) -> str:
    """Of a file: with the size of the RV, where there are several."""
    return kind if rv is None else f"{kind}-rv{rv:g}"


def scan_line_sample(
    measured: Measurement, variant: str, axis: Vector, lines: int = LINES
) -> Segments:
    """A few scan lines along the loading axis and across it, in the dump's coordinates."""
    position, radius, window = measured.spheres_of(VARIANTS[variant])
    frame = line_triads(np.array([axis]))[0]
    # along the axis, and along the first direction across it
    frames = np.stack([frame, np.roll(frame, -1, axis=0)])
    found = sample_segments(position, radius, frames, lines, window)
    return replace(found, ends=found.ends + measured.solids.origin)


def _time(result: FrameResult) -> float:
    """Time of the dump, else its step, else the frame's number."""
    packing = result.sample.packing
    known = [value for value in (packing.time, packing.step) if value is not None]
    return float(known[0] if known else result.number)


def _reach(result: FrameResult) -> float:
    last = result.rows[-1]
    measured = result.measured(last.variant, number_of(last, "rv"))
    position, _, window = measured.spheres_of(VARIANTS[last.variant])
    return window.reach if window else float(np.linalg.norm(position, axis=1).max())


def _tensors(row: Row) -> dict[str, FloatArray]:
    """The row's tensors that exist, shape (3, 3)."""
    found = {}
    for name in ("gvs", "gc"):
        matrix = np.empty((3, 3))
        for component, (i, j) in COMPONENTS.items():
            value = getattr(row, f"{name}_{component}")
            matrix[i, j] = matrix[j, i] = np.nan if value is None else value
        if np.isfinite(matrix).all():
            found[name] = matrix
    return found


def _fields(rows: list[Row]) -> dict[str, Any]:
    """The rows' values by column, one for each row; NaN where there is none."""
    columns: dict[str, Any] = {}
    for name in rows[0]:
        values = [getattr(row, name) for row in rows]
        if name in TEXT_FIELDS:
            # VTK's texts are ASCII
            columns[name] = [str(v).encode("ascii", "backslashreplace").decode() for v in values]
        else:
            columns[name] = np.array(
                [np.nan if value is None else value for value in values], np.float64
            )
    return columns

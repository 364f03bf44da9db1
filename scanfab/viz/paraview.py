"""Computed frames as ParaView files: which kinds there are, and what each holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.typing import FloatArray
from scanfab.fabric.distribution import direction_points, mean_length_function
from scanfab.fabric.tensor import COMPONENTS
from scanfab.packing.sample import VARIANTS
from scanfab.packing.window import Window
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.maps.settings import MapSettings
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.settings import Settings
from scanfab.scan.lines import line_triads
from scanfab.scan.segments import Segments, sample_segments
from scanfab.table.row import Row, number_of
from scanfab.viz import vtk_files as vtk
from scanfab.viz.scene import contact_lines, grains_of

LINES = 120
TEXT_FIELDS = ("source", "variant", "contacts_from", "edge")


class VtkFolder(vtk.Folder):
    """ParaView files of one series, to be called with each of its computed frames."""

    def __call__(self, result: FrameResult) -> None:
        """Write all files of a frame."""
        with self.lock:
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
        lines = scan_line_sample(measured, row.variant)
        mesh = vtk.line_mesh(lines, measured.plan.cutoff)
        self._save(f"lines-{name}", mesh, result, fields)
        space = measured.plan.space
        kept = measured.kept(row.variant)
        function = mean_length_function(measured.sums.axes, *kept, space)
        if function is not None and row.alpha_vs is not None:
            points, weights = direction_points(space)
            surface = vtk.distribution_mesh(points, function(points), weights, space)
            self._save(f"distribution-{name}", surface, result, fields)
        tensors = _tensors(row)
        if tensors:
            size = 0.3 * _reach(result)
            mesh = vtk.ellipsoid_mesh(tensors, center, size, space)
            self._save(f"ellipsoids-{name}", mesh, result, fields)
            mesh = vtk.tensor_points(tensors, center)
            self._save(f"tensors-{name}", mesh, result, fields)

    def _save(self, kind: str, mesh: Any, result: FrameResult, fields: Mapping[str, Any]) -> None:
        self.save(kind, mesh, result.number, time_of(result), fields)


def vtk_folders(
    folder: Path, count: int, settings: Settings, go_on: bool
) -> Sequence[VtkFolder | MapFolder]:
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
    chosen = own if count > 1 else [folder]
    if isinstance(settings, MapSettings):
        return [MapFolder(one, go_on) for one in chosen]
    return [VtkFolder(one, go_on) for one in chosen]


def _windows(result: FrameResult) -> Iterator[tuple[float | None, Window]]:
    """The RVs of a frame with their sizes, if there are several to be told apart."""
    for measured in result.measurements:
        for rv in measured.plan.rvs[:1]:
            if rv.window is not None:
                yield rv.fraction, rv.window


def _name(kind: str, rv: float | None) -> str:
    """Of a file: with the size of the RV, where there are several."""
    return kind if rv is None else f"{kind}-rv{rv:g}"


def scan_line_sample(measured: Measurement, variant: str, lines: int = LINES) -> Segments:
    """A few scan lines along the loading axis and across it, in the dump's coordinates."""
    axis = measured.plan.axis
    position, radius, window = measured.spheres_of(VARIANTS[variant])
    space = measured.plan.space
    frame = line_triads(np.array([axis]), space)[0]
    # along the axis, and along the first direction across it
    across = line_triads(frame[:1], space)[0] if space.is_plane else np.roll(frame, -1, axis=0)
    found = sample_segments(position, radius, np.stack([frame, across]), lines, window, space)
    return replace(found, ends=found.ends + measured.solids.origin)


class MapFolder(vtk.Folder):
    """A folder of ParaView files, to be called with each frame of a map."""

    def __call__(self, result: FrameResult) -> None:
        """The blocks of each variant as cells with all columns."""
        if result.blocks is None:
            return
        with self.lock:
            for variant in dict.fromkeys(row.variant for row in result.rows):
                rows = [row for row in result.rows if row.variant == variant]
                values = _fields(rows)
                # what is the same in all blocks is no value of a cell
                fields = {name: values.pop(name)[:1] for name in TEXT_FIELDS if name in values}
                mesh = vtk.block_mesh(result.blocks[variant in "cd"], values)
                self.save(f"map-{variant}", mesh, result.number, time_of(result), fields)


def time_of(result: FrameResult) -> float:
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

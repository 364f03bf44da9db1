"""ParaView files: one a frame and kind, and one collection (.pvd) a kind that knows the times."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.fabric.distribution import direction_points, mean_length_function
from scanfab.packing.sample import VARIANTS
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.map_settings import MapSettings
from scanfab.pipeline.measurement import Measurement
from scanfab.pipeline.settings import Settings
from scanfab.scan.lines import Segments, line_triads, sample_segments
from scanfab.table.row import Row, number_of
from scanfab.table.table import Table
from scanfab.viz.scene import grains_of

LINES = 120
TEXT_FIELDS = ("source", "variant", "contacts_from", "edge")
ENTRY = re.compile(r'<DataSet timestep="([^"]*)" file="([^"]*)"/>')

Fields = Mapping[str, Any]
Meshes = Iterator[tuple[str, Any, Fields]]
"""The kind of a mesh, the mesh, and its field data."""


def vtk_folders(
    folder: Path, count: int, settings: Settings, go_on: bool
) -> Sequence[Callable[[FrameResult], None]]:
    """
    Make the folders for ParaView files; each of several series has a folder of its own.

    Raises
    ------
    SettingsError
        If a folder cannot be made or written to, or if there are several cut-offs.
    """
    if settings.cutoffs:
        raise SettingsError("vtk: files for ParaView are of one cut-off: leave out `cutoffs`")
    chosen = [folder]
    if count > 1:
        chosen = [folder / f"series-{number}" for number in range(1, count + 1)]
    meshes_of = map_meshes if isinstance(settings, MapSettings) else frame_meshes
    return [VtkFolder(one, go_on, meshes_of) for one in chosen]


def frame_meshes(result: FrameResult) -> Meshes:
    """The grains, contacts and RVs of a frame, and what each variant's scan says."""
    from scanfab.viz import meshes

    # the name of a file tells its RV only if there are several RVs
    windows = {
        _name("window", rv.fraction): rv.window
        for measured in result.measurements
        for rv in measured.plan.rvs[:1]
        if rv.window is not None
    }
    # the largest RV holds the others
    window = [None, *windows.values()][-1]
    fields = _fields(result.rows)
    yield "grains", meshes.grain_mesh(grains_of(result.sample, window)), fields
    yield "contacts", meshes.contact_mesh(result.sample, window), fields
    for name, one in windows.items():
        yield name, meshes.window_mesh(one.center, one.shape), fields
    if result.measurements:
        # ellipsoids of all variants have the size of the last one's
        last = result.rows[-1]
        measured = result.measured(last.variant, number_of(last, "rv"))
        position, _, region = measured.spheres_of(VARIANTS[last.variant])
        reach = region.reach if region else float(np.linalg.norm(position, axis=1).max())
        for row in result.rows:
            yield from _variant_meshes(result, row, 0.3 * reach)


def _variant_meshes(result: FrameResult, row: Row, size: float) -> Meshes:
    from scanfab.viz import meshes

    rv, fields = number_of(row, "rv"), _fields([row])
    measured, name = result.measured(row.variant, rv), _name(row.variant, rv)
    center, space = measured.solids.origin, measured.plan.space
    lines = scan_line_sample(measured, row.variant)
    yield f"lines-{name}", meshes.line_mesh(lines, measured.plan.cutoff), fields
    mean_length = mean_length_function(measured.sums.axes, *measured.kept(row.variant), space)
    if mean_length is not None and row.alpha_vs is not None:
        points, weights = direction_points(space)
        mesh = meshes.distribution_mesh(points, mean_length(points), weights, space)
        yield f"distribution-{name}", mesh, fields
    every = {kind: Table([row]).tensor(kind)[0] for kind in ("gvs", "gc")}
    tensors = {kind: matrix for kind, matrix in every.items() if np.isfinite(matrix).all()}
    if tensors:
        mesh = meshes.ellipsoid_mesh(tensors, center, size, space)
        yield f"ellipsoids-{name}", mesh, fields
        yield f"tensors-{name}", meshes.tensor_points(tensors, center), fields


def scan_line_sample(measured: Measurement, variant: str) -> Segments:
    """A few scan lines along the loading axis and across it, in the dump's coordinates."""
    position, radius, window = measured.spheres_of(VARIANTS[variant])
    space = measured.plan.space
    frame = line_triads(np.array([measured.plan.settings.axis]), space)[0]
    # along the axis, and along the first direction across it
    across = line_triads(frame[:1], space)[0] if space.is_plane else np.roll(frame, -1, axis=0)
    found = sample_segments(position, radius, np.stack([frame, across]), LINES, window, space)
    return replace(found, ends=found.ends + measured.solids.origin)


def map_meshes(result: FrameResult) -> Meshes:
    """The blocks of each variant of a map as cells with all columns."""
    from scanfab.viz import meshes

    if result.blocks is None:
        return
    for variant in dict.fromkeys(row.variant for row in result.rows):
        values = _fields([row for row in result.rows if row.variant == variant])
        # texts are the same in all blocks, so they are fields of the mesh
        fields = {name: values.pop(name)[:1] for name in TEXT_FIELDS if name in values}
        yield f"map-{variant}", meshes.block_mesh(result.blocks[variant in "cd"], values), fields


def _name(kind: str, rv: float | None) -> str:
    return kind if rv is None else f"{kind}-rv{rv:g}"


def _fields(rows: list[Row]) -> dict[str, Any]:
    """The values of rows by column; NaN if a row has none."""
    columns: dict[str, Any] = {}
    for name in rows[0]:
        values = [getattr(row, name) for row in rows]
        if name in TEXT_FIELDS:
            # VTK's texts are ASCII
            columns[name] = [str(v).encode("ascii", "backslashreplace").decode() for v in values]
        else:
            columns[name] = np.array([np.nan if v is None else v for v in values], np.float64)
    return columns


class VtkFolder:
    """
    A folder of the ParaView files of one series, to be called with each of its computed frames.

    Parameters
    ----------
    folder : Path
        Is made if it does not exist.
    go_on : bool, optional
        Keep the frames of an earlier run in the collections.
    meshes_of : callable, optional
        The meshes of a frame: :func:`frame_meshes` or :func:`map_meshes`.

    Raises
    ------
    SettingsError
        If the folder cannot be made or written to.
    """

    def __init__(self, folder: Path, go_on: bool = False, meshes_of: Any = frame_meshes) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SettingsError(f"vtk: {folder} cannot be made: {error.strerror}") from None
        check_folder(folder / "grains.pvd")
        self.folder, self.go_on, self.meshes_of = folder, go_on, meshes_of
        # the time of each file, by kind
        self._times: dict[str, dict[str, float]] = {}
        # VTK must not be used by several threads at once
        self._lock = Lock()

    def __call__(self, result: FrameResult) -> None:
        """Write all files of a frame, and the collections with it."""
        packing = result.sample.packing
        known = [one for one in (packing.time, packing.step, result.number) if one is not None]
        with self._lock:
            for kind, mesh, fields in self.meshes_of(result):
                suffix = "vtu" if type(mesh).__name__ == "UnstructuredGrid" else "vtp"
                file = f"{kind}_{result.number:06d}.{suffix}"
                save_mesh(mesh, self.folder / file, fields)
                self._collect(kind, file, float(known[0]))

    def _collect(self, kind: str, file: str, time: float) -> None:
        """Add a file to the collection of its kind, which is complete after each frame."""
        path = self.folder / f"{kind}.pvd"
        if kind not in self._times:
            before = path.read_text("utf-8") if self.go_on and path.exists() else ""
            self._times[kind] = {name: float(at) for at, name in ENTRY.findall(before)}
        self._times[kind][file] = time
        entries = sorted((at, name) for name, at in self._times[kind].items())
        lines = [f'    <DataSet timestep="{at!r}" file="{name}"/>\n' for at, name in entries]
        text = (
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
            f"{''.join(lines)}  </Collection>\n</VTKFile>\n"
        )
        with whole_file(path) as part:
            part.write_text(text, encoding="utf-8")


def save_mesh(mesh: Any, path: Path, fields: Fields) -> None:
    """
    Write a mesh with field data; the file is complete or untouched.

    A field with the name of an array of the mesh is called ``row_NAME``: viewers ask by name.
    """
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter, vtkXMLUnstructuredGridWriter

    taken = {*mesh.point_data, *mesh.cell_data}
    for name, values in fields.items():
        mesh.field_data[f"row_{name}" if name in taken else name] = values
    writer = vtkXMLUnstructuredGridWriter() if path.suffix == ".vtu" else vtkXMLPolyDataWriter()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    # into memory first, as VTK crashes when it writes to a full disk
    writer.WriteToOutputStringOn()
    writer.Write()
    with whole_file(path) as part:
        part.write_text(writer.GetOutputString(), encoding="utf-8", newline="\n")

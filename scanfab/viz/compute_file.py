"""compute_file(): compute a fabric table into a file, with its manifest and ParaView files."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import Any

from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder, whole_file
from scanfab.base.option import options_of, refuse_unknown
from scanfab.io.families import PathLike, expanded
from scanfab.io.reader import READING
from scanfab.io.series import Series
from scanfab.io.sources import open_sources
from scanfab.pipeline.frame import FrameResult
from scanfab.pipeline.job import Job
from scanfab.pipeline.map_settings import BLOCK_OPTIONS, MapSettings, is_map
from scanfab.pipeline.options import Output, listening
from scanfab.pipeline.record import part_of
from scanfab.pipeline.settings import Settings
from scanfab.table.selection import MAP
from scanfab.table.table import Table, load
from scanfab.table.writing import Excerpt

Source = Series | PathLike
ENTRY = re.compile(r'<DataSet timestep="([^"]*)" file="([^"]*)"/>')


def compute_file(
    source: Source | Sequence[Source],
    output: PathLike,
    *,
    resume: bool = False,
    vtk: PathLike | None = None,
    manifest: PathLike | None = None,
    fields: str | Sequence[str] | None = None,
    digits: int = DEFAULT_DIGITS,
    progress: Callable[[int, int], object] | None = None,
    executor: Executor | None = None,
    **options: Any,
) -> Table:
    """
    Compute the fabric table of a series into a file, frame by frame: ``scanfab compute -o``.

    Rows are written to ``FILE.part`` frame by frame, so that an interrupted computation can be
    resumed. FILE is replaced at the end: it is complete or untouched. The command line writes the
    same bytes, so it can resume a computation that this function began, and vice versa.

    Parameters
    ----------
    source : Series, path, or sequence of them
        Series of :func:`scanfab.read_series`, or paths of files and folders: each folder is a
        series, and all single files together are one series.
    output : path
        ``.csv``, ``.tsv``, ``.json``, ``.jsonl``, ``.parquet``, or a format of another package.
        ``FILE.manifest.json`` beside it holds settings, versions, inputs with size and hash,
        warnings and notes.
    resume : bool, optional
        Continue ``FILE.part``, or add missing frames to a complete FILE. The result is the same as
        if all frames were computed at once; settings and inputs must be the same.
    vtk : path, optional
        A folder for ParaView files of each frame that is computed now.
    manifest : path, optional
        A copy of the manifest.
    fields : str or sequence of str, optional
        Which columns to write, in this order: a sequence of names, or a text with commas.
    digits : int, optional
        Significant digits of floats; with 17 they read back the same.
    progress : callable, optional
        Called after each frame with the number of finished frames and an estimate of all frames.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.
    **options
        Options of :func:`scanfab.compute`, or of :func:`scanfab.fabric_map` if `grid`, `slices` or
        `shells` is given; for paths also options of :func:`scanfab.read_series`.

    Returns
    -------
    Table
        The table of the file.

    Raises
    ------
    ScanfabError
        If a frame cannot be read or computed (finished frames can be resumed), if another run
        writes to the file, or if the rows to resume were made by other settings or of other inputs.
    OSError
        If the file cannot be written, for instance on a full disk; this can be resumed as well.
    TypeError
        If there is no such option; the message suggests the most similar name.

    Warns
    -----
    ScanfabWarning, ScanfabNote
        Doubts about frames, and frames that were skipped, at the end of the computation. The
        manifest lists them too, whatever the filters of warnings.

    Examples
    --------
    >>> import scanfab, tempfile
    >>> series = scanfab.read_series("sample_data/liggghts_periodic")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = scanfab.compute_file(
    ...         series, f"{folder}/fabric.csv", frames=":2", variants="a", tolerance=0.01
    ...     )
    >>> [row.step for row in table]
    [30000, 60000]
    """
    kind = MapSettings if is_map(options) else Settings
    known = [*READING, *(option.name for option in options_of(MapSettings))]
    refuse_unknown("compute_file", options, known)
    if kind is Settings:
        options = {name: value for name, value in options.items() if name not in BLOCK_OPTIONS}
    if vtk is not None and executor is not None:
        raise SettingsError("vtk: it cannot be written with an `executor`: leave out one of them")
    outputs = Output(
        output=Path(output),
        resume=resume,
        vtk=None if vtk is None else Path(vtk),
        manifest=None if manifest is None else Path(manifest),
    )
    with listening() as told:
        series = _opened(source, options)
        settings = kind(**options)
        excerpt = Excerpt.make(settings.columns, fields, digits)
        job = table_job(series, settings, outputs, excerpt, told=told, executor=executor)
        with job.begun():
            list(job.rows(lambda: progress and progress(job.done, job.frames())))
    return load(Path(output))


def table_job(
    series: Sequence[Series], settings: Settings, outputs: Output, excerpt: Excerpt, **more: Any
) -> Job:
    """
    The computation of a table into the files that the options of output name.

    It refuses to replace an input by a figure or by files for ParaView. ``more`` are its further
    arguments.
    """
    drawn = [] if outputs.plot is None else [outputs.plot]
    folders: list[VtkFolder] = []
    if outputs.vtk is not None:
        resumed = outputs.output if outputs.resume else None
        folders = vtk_folders(outputs.vtk, series, settings, resumed)
        drawn += [*outputs.vtk.rglob("*.vt[pu]"), *outputs.vtk.rglob("*.pvd")]
    more |= {"resume": outputs.resume, "manifest_path": outputs.manifest}
    return Job(series, settings, outputs.output, excerpt, drawn=drawn, observers=folders, **more)


def _opened(source: Source | Sequence[Source], options: dict[str, Any]) -> Sequence[Series]:
    """Open the series of a source; the options of reading are taken out of ``options``."""
    is_one = isinstance(source, Series | str | os.PathLike) or not isinstance(source, Iterable)
    given: list[Any] = [source] if is_one else list(source)  # type: ignore[arg-type]
    if given and all(isinstance(one, Series) for one in given):
        for name in {*READING} & {*options}:
            raise SettingsError(f"{name}: the series is open already: hand it to `read_series`")
        return given
    if not given or not all(isinstance(one, str | os.PathLike) for one in given):
        raise SettingsError(
            f"expected a Series or the path of dumps, or several of one kind, found {source!r}: "
            f"for packings call compute(), and save() of its table"
        )
    paths = [os.fspath(path) for one in given for path in expanded(one)]
    return open_sources(paths, **{name: options.pop(name) for name in {*READING} & {*options}})


def vtk_folders(
    folder: Path, series: Sequence[Series], settings: Settings, resumed: Path | None
) -> list[VtkFolder]:
    """
    Make the folders for ParaView files; each of several series has a folder of its own.

    ``resumed`` is the table that the run goes on with, if it exists.

    Raises
    ------
    SettingsError
        If a folder cannot be made or written to or holds the dumps, or if there are several
        cut-offs.
    """
    if settings.cutoffs:
        raise SettingsError("vtk: files for ParaView are of one cut-off: leave out `cutoffs`")
    for source in chain.from_iterable(one.sources for one in series):
        # the next run would take the files for dumps
        place = Path(source) if Path(source).is_dir() else Path(source).parent
        if source != "-" and place.resolve() == folder.resolve():
            raise SettingsError(f"vtk: {folder} holds the dumps: name another folder")
    several = [folder / f"series-{number}" for number in range(1, len(series) + 1)]
    go_on = resumed is not None and (resumed.exists() or part_of(resumed).exists())
    return [VtkFolder(one, go_on) for one in (several if len(series) > 1 else [folder])]


class VtkFolder:
    """
    A folder of the ParaView files of one series, to be called with each of its computed frames.

    Parameters
    ----------
    folder : Path
        Is made if it does not exist.
    go_on : bool, optional
        Keep the frames of an earlier run in the collections.

    Raises
    ------
    SettingsError
        If the folder cannot be made or written to.
    """

    def __init__(self, folder: Path, go_on: bool = False) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SettingsError(f"vtk: {folder} cannot be made: {error.strerror}") from None
        check_folder(folder / "grains.pvd")
        self.folder, self.go_on = folder, go_on
        # the time of each file, by kind
        self._times: dict[str, dict[str, float]] = {}
        # VTK must not be used by several threads at once
        self._lock = Lock()

    def __call__(self, result: FrameResult) -> None:
        """Write all files of a frame, and the collections with it."""
        # loaded here, as VTK takes a second that a run without these files need not wait
        from scanfab.viz.meshes import frame_meshes, map_meshes, save_mesh

        packing = result.sample.packing
        known = [one for one in (packing.time, packing.step, result.number) if one is not None]
        meshes = map_meshes(result) if MAP in result.rows[0] else frame_meshes(result)
        with self._lock:
            for kind, mesh, fields in meshes:
                path = save_mesh(mesh, self.folder / f"{kind}_{result.number:06d}", fields)
                self._collect(kind, path.name, float(known[0]))

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

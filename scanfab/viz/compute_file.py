"""compute_file(): a fabric table in a file, with its manifest and ParaView files, by one call."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, TypeVar

from scanfab.base.column import DEFAULT_DIGITS
from scanfab.base.errors import SettingsError
from scanfab.base.option import options_of, refuse_unknown
from scanfab.io.families import PathLike, expanded
from scanfab.io.options import take_reading
from scanfab.io.series import Series
from scanfab.io.sources import READING, open_sources
from scanfab.pipeline.frames import of_whole
from scanfab.pipeline.job import Job
from scanfab.pipeline.maps.settings import BLOCK_OPTIONS, MapSettings, is_map
from scanfab.pipeline.record import asked_for
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.told import listening
from scanfab.table.table import Table, load
from scanfab.table.writing import Excerpt
from scanfab.viz.paraview import vtk_folders

Source = Series | PathLike
T = TypeVar("T")


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

    Rows are kept in ``FILE.part`` as they come, so that an interrupted computation can be gone on
    with; that becomes FILE at the end, which is complete or untouched. Files are those of the
    command line, byte for byte: what one has begun, the other can resume.

    Parameters
    ----------
    source : Series, path, or sequence of them
        What :func:`scanfab.read_series` returns, or files and folders: each folder is a series of
        its own, all single files together are one.
    output : path
        ``.csv``, ``.tsv``, ``.json``, ``.jsonl``, ``.parquet``, or a format of another package.
        ``FILE.manifest.json`` beside it says what made it: settings, versions, inputs with size and
        hash, and what was told.
    resume : bool, optional
        Go on with ``FILE.part``, or add to a complete FILE the frames that it lacks. The result is
        that of one computation of all frames; settings and inputs must be the same.
    vtk : path, optional
        A folder for ParaView files of each frame that is computed now.
    manifest : path, optional
        A copy of the manifest.
    fields : str or sequence of str, optional
        Names of columns, one by one or separated by commas, in the order in which to write them.
    digits : int, optional
        Significant digits of floats; with 17 they read back the same.
    progress : callable, optional
        Called after each frame with the number of finished frames, and about how many there are.
    executor : concurrent.futures.Executor, optional
        As for :func:`scanfab.compute`.
    **options
        Those of :func:`scanfab.compute`, or with `grid`, `slices` or `shells` those of
        :func:`scanfab.fabric_map`; for paths those of :func:`scanfab.read_series` too.

    Returns
    -------
    Table
        What the file holds.

    Raises
    ------
    ScanfabError
        If a frame cannot be read or computed (what is finished can be resumed), if another run
        writes to the file, or if what is there was made by other settings or of other inputs.
    OSError
        If the file cannot be written to, as on a full disk; this can be resumed as well.
    TypeError
        If there is no such option; names the nearest that there is.

    Warns
    -----
    ScanfabWarning, ScanfabNote
        Doubts of frames, and frames that were skipped, when all is done; the manifest lists them,
        also those that are filtered away.

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
    known = [*READING, *(one.name for one in options_of(MapSettings))]
    refuse_unknown("compute_file", options, known)
    if kind is Settings:
        options = {name: one for name, one in options.items() if name not in BLOCK_OPTIONS}
    with listening() as told:
        opened = _opened(source, options)
        parts = [of_whole(one, kind(**options)) for one in opened]
        settings = _same(one for _, one in parts)
        sources = [name for one in opened for name in one.sources or (one.name,)]
        reading = take_reading(dict(_same(one.reading for one in opened)))
        excerpt = Excerpt.make(settings.columns, fields, digits)
        job = Job(
            [one for one, _ in parts],
            settings,
            asked_for(sources, reading, settings, excerpt),
            Path(output),
            excerpt,
            resume=resume,
            manifest_path=None if manifest is None else Path(manifest),
            observers=() if vtk is None else vtk_folders(Path(vtk), len(parts), settings, resume),
            told=told,
            executor=executor,
        )
        with job.begun():
            job.write(lambda: progress and progress(job.done, job.frames()))
    return load(Path(output))


def _opened(source: Source | Sequence[Source], options: dict[str, Any]) -> Sequence[Series]:
    """The series of a source; the options of reading are taken out of others."""
    one = isinstance(source, Series | str | os.PathLike) or not isinstance(source, Iterable)
    given: list[Any] = [source] if one else list(source)  # type: ignore[arg-type]
    if given and all(isinstance(one, Series) for one in given):
        for name in {*READING} & {*options}:
            raise SettingsError(f"{name}: the series is open already: hand it to `read_series`")
        return given
    if not given or not all(isinstance(one, str | os.PathLike) for one in given):
        raise SettingsError(
            f"expected a Series or the path of dumps, or several of one kind, found {source!r}: "
            f"of packings, compute() makes a table, which has save()"
        )
    paths = [os.fspath(path) for one in given for path in expanded(one)]
    return open_sources(paths, **take_reading(options))


def _same(found: Iterable[T]) -> T:
    """What is the same for all series of one table, as its manifest names it once."""
    first, *others = found
    if any(one != first for one in others):
        raise SettingsError(
            "the series of one table are to be read with the same options, and to be parts of the "
            "same frames: compute them into tables of their own"
        )
    return first

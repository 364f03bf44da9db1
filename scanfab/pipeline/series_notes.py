"""What a run says of a series: each note once, and at the end the frames that it holds for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from scanfab.base.errors import Note, ScanfabNote, SkippedFrameWarning, tell
from scanfab.base.typing import FloatArray
from scanfab.packing.bodies import Grouping, regrouped
from scanfab.packing.cell import Cell
from scanfab.packing.sample import Sample
from scanfab.packing.window import SurfaceBox
from scanfab.pipeline.settings import Settings
from scanfab.pipeline.strain import flip_notes
from scanfab.pipeline.values import AXES
from scanfab.table.curves import is_turned
from scanfab.table.row import Row

# least relative changes of radii and of extents that are worth a note
GROWTH, STRAIN = 0.01, 0.001
# cosine of the angle within which the axis of the contact fabric counts as x, y or z
ALONG = 0.95


class Facts(NamedTuple):
    """Facts about a frame that has grains, which are compared with those of other frames."""

    smallest: float
    """Radius of the smallest grain, dump's length unit."""
    extents: FloatArray
    """Extents of the grains' surfaces (of the cell, where it is periodic), shape (3,)."""
    cell: Cell | None
    grouping: Grouping | None
    """The clumps; None if each sphere is a grain."""

    @classmethod
    def of(cls, sample: Sample) -> Facts:
        """The facts about a sample."""
        packing, grouping = sample.packing, None
        if packing.bodies is not None:
            grouping = Grouping(packing.id, packing.id[packing.bodies.head])
        extents = SurfaceBox.of(packing, sample.gathered).extents
        return cls(float(packing.radius[sample.grains].min()), extents, packing.cell, grouping)


class SeriesNotes:
    """
    Issues the notes on the frames of one series, which come in their order.

    A note is issued at the first frame that it holds for. If it holds for several frames, one more
    line names them at the end. ``name`` is that of the series; it is told if it is not empty.
    ``reference`` is the number of the reference frame and its smallest radius.
    """

    def __init__(self, settings: Settings, name: str, reference: tuple[int, float]) -> None:
        self.settings, self.name, self.reference = settings, name, reference
        self._held: dict[tuple[str, tuple[str, ...]], tuple[Note, list[int]]] = {}
        """The first note of each kind, and the numbers of its frames."""
        self._last: tuple[int, Cell | None] = 0, None
        """Number and cell of the last frame that had grains."""
        self._grouping: tuple[int, Grouping] | None = None
        self._facts: list[Facts] = []
        self._rows: list[Row] = []

    def add(
        self, number: int, rows: Sequence[Row], notes: Sequence[Note], facts: Facts | None
    ) -> None:
        """Issue the notes on a frame that no frame before had."""
        found = [*notes]
        if facts is not None:
            found += flip_notes(*self._last, number, facts.cell)
            self._last = number, facts.cell
            self._facts.append(facts._replace(grouping=None))
            if facts.grouping is not None:
                self._grouping = self._grouping or (number, facts.grouping)
                found += filter(None, [regrouped(*self._grouping, facts.grouping)])
        self._rows += rows
        for note in found:
            _, frames = self._held.setdefault((note.code, note.variants), (note, []))
            if not frames or note.kind is SkippedFrameWarning:
                self._tell([note], f"frame {number}")
            # a frame of several cut-offs has the same note several times
            if frames[-1:] != [number]:
                frames.append(number)

    def end(self) -> None:
        """Issue the lines at the end of a series."""
        step = abs(self.settings.frames.step or 1)
        for note, frames in self._held.values():
            if len(frames) > 1 and note.kind is not SkippedFrameWarning:
                # in a run of frames the number grows by the step
                runs = groupby(enumerate(frames), lambda pair: pair[1] - step * pair[0])
                ends = [[number for _, number in run] for _, run in runs]
                spelt = ", ".join(
                    f"{run[0]} to {run[-1]}" if run[1:] else f"{run[0]}" for run in ends
                )
                text = f"as in frame {frames[0]}, {note.text.split(': ')[0]}"
                self._tell([note._replace(text=text)], f"frames {spelt}")
        self._tell(self._of_series())

    def _tell(self, notes: Iterable[Note], where: str = "") -> None:
        tell(notes, ", ".join(filter(None, [self.name, where])))

    def _of_series(self) -> Iterator[Note]:
        """Notes that only all frames together show."""
        number, radius = self.reference
        smallest = np.array([facts.smallest for facts in self._facts])
        ends = dict.fromkeys(f"{f(smallest):.4g}" for f in (np.min, np.max) if len(smallest))
        spelt = " to ".join(ends)
        if np.any(np.abs(smallest / radius - 1.0) > GROWTH):
            yield Note(
                "radii_change",
                f"the smallest radius is {spelt}, but 1rmin is {radius:.4g} in all frames, "
                f"as in frame {number}: "
                f"`reference` chooses another frame for the lengths of the series",
                kind=ScanfabNote,
            )
        extents = np.array([facts.extents for facts in self._facts]).reshape(-1, 3)
        lacks_strain = all(row.get("strain") is None for row in self._rows)
        if len(extents) > 1 and lacks_strain and self.settings.strain == "auto":
            change = float(np.max(np.ptp(extents, axis=0) / extents.max(axis=0)))
            if change > STRAIN:
                yield Note(
                    "no_strain",
                    f"the column strain is empty, since no periodic edge of a cell lies along the "
                    f"loading axis and no boundary is named, but the extents of the grains change "
                    f"by {change:.2g}: "
                    f'`strain="grains"` measures the strain by them',
                    kind=ScanfabNote,
                )
        yield from self._turned()

    def _turned(self) -> Iterator[Note]:
        """A note if the loading axis is not the axis of the contact fabric."""
        rows = [row for row in self._rows if row.get("gc_axis_x") is not None]
        if not rows or not is_turned(rows):
            return
        clearest = max(rows, key=lambda row: row["alpha_c"] / (row["alpha_c_axial_se"] or np.inf))
        axis = [clearest[f"gc_axis_{name}"] for name in "xyz"]
        if abs(np.dot(axis, self.settings.axis)) > ALONG:
            # its minor axes differ so much that its axial part is small
            return
        near = [name for name, part in zip(AXES, axis, strict=True) if abs(part) > ALONG]
        major = near[0] if near else ",".join(f"{part:.3g}" for part in axis)
        text = "the loading axis is not the major axis of the contact fabric"
        yield Note("turned_axis", f'{text}, {major}: choose `axis="{major}"`', kind=ScanfabNote)

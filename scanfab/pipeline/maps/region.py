"""The blocks of one region, the whole sample or the RV: what its two variants share."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np

from scanfab.base.typing import BoolArray, FloatArray, IntArray
from scanfab.packing.window import Window
from scanfab.pipeline.maps.measurement import MapMeasurement
from scanfab.pipeline.maps.surface import cut_by_hull, cut_by_window, volumes_inside
from scanfab.scan.edges import ENDS, START


class Region:
    """The blocks of the whole sample, of a and b, or of the window, of c and d."""

    def __init__(self, measurement: MapMeasurement, *, in_window: bool) -> None:
        self.measurement = measurement
        self.sample, self.plan = measurement.sample, measurement.plan
        self.blocks = measurement.blocks[in_window]
        self.splits = measurement.splits[in_window]
        self.window: Window | None = self.plan.window if in_window else None
        """None for the whole."""

    @cached_property
    def at_surface(self) -> BoolArray:
        """Which blocks lose segments, shape (B,)."""
        plan, inner = self.plan, self.measurement.solids.inner
        mean = float(self.sample.packing.radius[self.sample.gathered].mean())
        if self.window is not None:
            if plan.edge == START:
                # it follows segments beyond the RV, and gives each end to the block it is in
                return np.zeros(len(self.blocks), bool)
            return cut_by_window(self.blocks, self.window.shape, self.window.center, mean)
        if plan.edge == ENDS and inner is not None:
            center = inner.center + self.measurement.solids.origin
            return cut_by_window(self.blocks, inner.shape, center, mean)
        return cut_by_hull(self.blocks, self.sample)

    @cached_property
    def volumes(self) -> FloatArray:
        """What of each part of each block lies in the region, shape (B, P)."""
        if self.window is None:
            return volumes_inside(self.blocks, self.splits, None, np.zeros(3))
        return volumes_inside(self.blocks, self.splits, self.window.shape, self.window.center)

    def parts_of(self, points: FloatArray) -> tuple[IntArray, IntArray]:
        """The block of each place, -1 for none, and which part of it."""
        if self.window is not None:
            points = self.window.center + self.window.branches(points, self.sample.packing)
        finer = self.blocks.finer(self.splits).of(points)
        block, part = self.blocks.of_finer(self.splits)
        return np.where(finer < 0, -1, block[finer]), part[finer]

    def sums(self, block: IntArray, part: IntArray, values: Any) -> FloatArray:
        """Values of places by the block and the part these lie in, shape (B, P)."""
        shape = len(self.blocks), math.prod(self.splits)
        inside = block >= 0
        where = block[inside] * shape[1] + part[inside]
        weights = np.asarray(values, np.float64)[inside]
        sums = np.bincount(where, weights, minlength=math.prod(shape))
        return np.asarray(sums.reshape(shape), np.float64)

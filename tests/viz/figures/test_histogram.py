"""Lengths of the void segments: their mean is that of the table."""

from __future__ import annotations

import pytest

from scanfab.pipeline.settings import Settings
from tests.helpers.figures import frame_figure, row_of

pytestmark = pytest.mark.filterwarnings("ignore:skipped:scanfab.base.errors.ScanfabNote")
SETTINGS = Settings(boundary="mask=3", tolerance=5e-4)


def test_lengths_have_the_mean_of_the_table(series, computed):
    figure = frame_figure(series, SETTINGS, computed.rows, "histogram")
    for sample, frame in zip(figure.samples, (0, 6), strict=True):
        row = row_of(computed, frame)
        kept = sample.length[sample.length >= sample.cutoff]
        assert len(sample.length) > 10_000
        assert kept.mean() == pytest.approx(row["mean_length"] / row["cutoff"], rel=0.03)

"""
Edge rules: what counts at a window's surface; and columns that say how a sample was scanned.

:mod:`scanfab.scan.kernels.sweep` says how each rule counts a segment, and docs/details/edges.md has
the theory. ``VariantColumns`` computes the values of the columns.
"""

from __future__ import annotations

from scanfab.base.column import LENGTH, Column

CLIP, START, ENDS = EDGES = ("clip", "start", "ends")

SCAN_COLUMNS = (
    Column(
        "solid_fraction",
        float,
        "",
        "of this variant's solids in the RV or periodic cell; else empty",
    ),
    Column("directions", int, "", "axes of the direction rule, in each replicate"),
    Column("replicates", int, "", "number of replicates"),
    Column("lines", int, "", "scan lines that meet the window (for the whole: any solid)"),
    Column("segments", int, "", "void segments kept"),
    Column(
        "spacing",
        float,
        LENGTH,
        "distance between neighbouring lines of one direction, all replicates together",
    ),
    Column("cutoff", float, LENGTH, "shortest void segment kept"),
)

EDGE_COLUMNS = (
    Column(
        "edge",
        str,
        "",
        "what counts at the window's surface: clip, start or ends; empty where there is none",
    ),
    Column(
        "left_out",
        float,
        "",
        "share of the segments that leave the sample, and so are left out by the rule start",
    ),
)

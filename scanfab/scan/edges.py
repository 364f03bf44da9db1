"""
Edge rules: what counts at a window's surface.

:mod:`scanfab.scan.kernels.sweep` says how each rule counts a segment, and docs/details/edges.md has
the theory.
"""

from __future__ import annotations

CLIP, START, ENDS = EDGES = ("clip", "start", "ends")

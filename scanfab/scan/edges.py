"""
The rules of what counts at a window's surface, by name.

What a segment counts by each of them stands in :mod:`scanfab.scan.kernels.edges`, their theory in
docs/details/edges.md.
"""

from __future__ import annotations

CLIP, START, ENDS = EDGES = ("clip", "start", "ends")

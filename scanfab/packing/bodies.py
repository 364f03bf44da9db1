"""Bodies: which spheres of a dump are one grain, a clump, by the names of columns that say it."""

from __future__ import annotations

__all__ = ["CLUMP_COLUMNS"]

# by names in lower case; all but the first few number molecules, too
CLUMP_COLUMNS = ("clump", "clumpid", "clump_id", "id_multisphere", "mol", "molecule")

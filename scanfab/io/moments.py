"""Which snapshot of a contact file belongs to one of grains: by step, or by time without steps."""

from __future__ import annotations

from collections.abc import Sequence

from scanfab.io.reader import Snapshot

# of the time: programs write it with six digits or more
ROUNDING = 2e-6


def of_moment(snapshots: Sequence[Snapshot], grains: Snapshot, sure: bool) -> Snapshot | None:
    """
    The snapshot of the same moment; None if there is none.

    Parameters
    ----------
    snapshots : sequence of Snapshot
        Those of the contact file.
    grains : Snapshot
        Of the grains.
    sure : bool
        Whether the files belong together by their names: then a single snapshot needs no step.
    """
    timed = [one for one in snapshots if one.step is None and one.time is not None]
    if grains.step is None and grains.time is not None and timed:
        time = grains.time
        best = min(timed, key=lambda one: abs((one.time or 0.0) - time))
        return best if abs((best.time or 0.0) - time) <= ROUNDING * abs(time) else None
    if len(snapshots) == 1 and (snapshots[0].step is None or grains.step is None):
        return snapshots[0] if sure else None
    if grains.step is None:
        return None
    return next((one for one in snapshots if one.step == grains.step), None)

"""How much memory is left, where the system tells it."""

from __future__ import annotations

import re
import sys
from pathlib import Path

GROUP = Path("/sys/fs/cgroup")


def free_memory() -> int:
    """Bytes that this process can still get: of the machine, its container and its own limit."""
    found = [_of_machine(), _of_container(), address_space()]
    return max(min((one for one in found if one is not None), default=sys.maxsize), 0)


def _of_machine() -> int | None:
    try:
        text = Path("/proc/meminfo").read_text("ascii")
    except OSError:
        return None
    available = re.search(r"^MemAvailable:\s*(\d+) kB", text, re.MULTILINE)
    return None if available is None else int(available[1]) << 10


def _of_container() -> int | None:
    try:
        most, used = ((GROUP / f"memory.{name}").read_text("ascii") for name in ("max", "current"))
        return int(most) - int(used) + _old_cache()
    except (OSError, ValueError):  # not in one, or "max": no limit
        return None


def _old_cache() -> int:
    """Copies of files that the system keeps in the group's memory until someone needs the room."""
    try:
        text = (GROUP / "memory.stat").read_text("ascii")
    except OSError:
        return 0
    found = re.search(r"^inactive_file (\d+)$", text, re.MULTILINE)
    return 0 if found is None else int(found[1])


def address_space() -> int | None:
    """What ``ulimit -v`` leaves to this process; None without such a limit."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    except (ImportError, OSError):
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit - pages * resource.getpagesize()

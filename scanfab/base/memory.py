"""How much memory is left, where the system tells it."""

from __future__ import annotations

import re
import sys
from contextlib import suppress
from pathlib import Path

GROUP = Path("/sys/fs/cgroup")


def free_memory() -> int:
    """Bytes that this process can still get: of the machine, its container and its own limit."""
    found = [sys.maxsize]
    with suppress(OSError, TypeError):
        text = Path("/proc/meminfo").read_text("ascii")
        found.append(int(re.search(r"MemAvailable:\s*(\d+) kB", text)[1]) << 10)  # type: ignore[index]
    # not every process is in a container, and one without a limit has the word "max"
    with suppress(OSError, ValueError):
        most, used = (int((GROUP / f"memory.{one}").read_text()) for one in ("max", "current"))
        # copies of files that the system keeps until someone needs the room
        state = GROUP / "memory.stat"
        text = state.read_text("ascii") if state.exists() else ""
        cache = re.findall(r"(?m)^inactive_file (\d+)$", text)
        found.append(most - used + sum(map(int, cache)))
    own = address_space()
    return max(min(*found, sys.maxsize if own is None else own), 0)


def address_space() -> int | None:
    """What ``ulimit -v`` leaves to this process; None without such a limit."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    except (ImportError, OSError):
        return None
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return None if limit == resource.RLIM_INFINITY else limit - pages * resource.getpagesize()

"""
What becomes of every file of a folder: other people's dumps, which are not in the repository.

    python -m tests.campaigns.foreign_files FOLDER [--output found.csv] [--expected expected.csv]

Each file goes through `scanfab inspect` and, if that reads it, `scanfab compute`, in processes of
their own. A line for each file says which reader took it and what it found in the last frame, or
why it was refused. A table found earlier, or written by hand, can be expected: only the columns and
rows that it has are compared (`message` by being a part of what is said). The exit code is 1 if a
file differs from what is expected, or if a command broke: a traceback, a signal, or five minutes.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

from tests.campaigns.frame import asked
from tests.helpers.interruptions import PROGRAM

SECONDS = 300
# a rough scan: the dump is tried, not the fabric
ROUGH = ["--spacing", "1rmin", "--directions", "20", "--variants", "a"]
OF_THE_FRAME = ("format", "grains", "radius_min", "radius_max", "contacts", "contacts_from")
COLUMNS = ("file", "outcome", "frames", "periodic", *OF_THE_FRAME, "message")


def main() -> None:
    """Every file, one after the other."""
    given = asked(__doc__, folder=Path, output="found.csv", expected="", no_compute=False)
    expected, wrong = {}, 0
    if given.expected:
        with open(given.expected, newline="") as file:
            expected = {row["file"]: row for row in csv.DictReader(file)}
    with open(given.output, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        for path in sorted(given.folder.rglob("*")):
            if not path.is_file() or path.suffix == ".md":
                continue
            row = tried(path, not given.no_compute)
            row["file"] = str(path.relative_to(given.folder))
            writer.writerow(row)
            file.flush()
            found = differences(row, expected.pop(row["file"], {}))
            wrong += bool(found)
            print(f"{'WRONG ' if found else ''}{row['file']}: {', '.join(found) or spelt(row)}")
    print(*(f"WRONG {name}: is not there" for name in sorted(expected)), sep="\n")
    sys.exit(1 if wrong or expected else 0)


def tried(path: Path, compute: bool) -> dict[str, str]:
    """What both commands make of a file."""
    code, out, said = run(["inspect", "--json", "--frames", "-1:", str(path)])
    row = dict.fromkeys(COLUMNS, "")
    row["message"] = " ".join(said.replace(f"{path.parent}{os.sep}", "").split())
    row["outcome"] = {0: "read", 1: "refused"}.get(code, "broken")
    if "Traceback" in said:
        row["outcome"] = "broken"
    if row["outcome"] != "read":
        return row
    frame = json.loads(out.splitlines()[-1])
    row |= {name: "" if frame[name] is None else str(frame[name]) for name in OF_THE_FRAME}
    row["frames"] = str(frame["frame"] + 1)
    row["periodic"] = "".join("xyz"[k] for k in range(3) if (frame["periodic"] or [0] * 3)[k])
    if compute and frame["grains"]:
        code, out, said = run(["compute", "--frames", "-1:", *ROUGH, str(path)])
        # 1: no void fabric, such as that of two grains
        if code not in (0, 1) or "Traceback" in said:
            row["outcome"], row["message"] = "broken", f"compute: {said[-300:]}"
    return row


def run(words: list[str]) -> tuple[int, str, str]:
    """Exit code, output and messages; -1 if they are not done in time."""
    command = [*PROGRAM, *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return -1, "", f"not done after {SECONDS} s"
    return done.returncode, done.stdout, done.stderr


def differences(row: dict[str, str], expected: dict[str, str]) -> list[str]:
    """In what a row is not as expected; a broken command always is."""
    found = ["broken: " + row["message"]] if row["outcome"] == "broken" else []
    for name, value in expected.items():
        # an empty cell expects nothing
        if name not in row or name == "file" or not value or same(name, row[name], value):
            continue
        found.append(f"{name}: {row[name]!r}, expected {value!r}")
    return found


def same(name: str, found: str, expected: str) -> bool:
    """Numbers to six digits, as other people's indexes have them."""
    if name == "message":
        return expected in found
    try:
        return abs(float(found) - float(expected)) <= 2e-6 * abs(float(expected))
    except ValueError:
        return found == expected


def spelt(row: dict[str, str]) -> str:
    """A row for people."""
    if row["outcome"] != "read":
        return f"{row['outcome']}: {row['message'][-200:]}"
    return f"{row['format']}, {row['grains']} grains, {row['contacts']} contacts"


if __name__ == "__main__":
    main()

"""
Random damage for the readers, without a guide: quicker than fuzz_readers.py, and needs no package.

    python tests/campaigns/mutate_readers.py [--runs 5000] [READER ...] [--only .bin]

Small sound files of each format are damaged at random, and read as grains and as contacts.
Anything but an answer or a ScanfabError is kept in the folder `mutate_findings`, as is what takes
over 10 s; one line for each reader at the end.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import traceback
from pathlib import Path
from random import Random

ROOT = Path(__file__).resolve().parents[2]
# in the place of this folder, whose coverage.py is not the package of that name
sys.path[0] = str(ROOT)

from scanfab.base.errors import ScanfabError  # noqa: E402
from scanfab.io.reader import GrainTable  # noqa: E402
from scanfab.io.registry import reader_named  # noqa: E402
from scanfab.packing.packing import Packing  # noqa: E402
from tests.helpers import fuzzing, sound_files  # noqa: E402

SECONDS = 10.0
OUT = Path("mutate_findings")


def main() -> None:
    """Each reader in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*", default=[])
    parser.add_argument("--runs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", default=[""], help="endings of the files to damage")
    given = parser.parse_args()
    for name in given.readers or fuzzing.READERS:
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            findings, answers = damage(
                name, given.runs, Random(given.seed), Path(folder), tuple(given.only)
            )
        print(
            f"{name}: {given.runs} executions, {time.monotonic() - began:.0f} s, {answers} read, "
            f"{findings} findings",
            flush=True,
        )


def damage(
    name: str, runs: int, random: Random, folder: Path, only: tuple[str, ...] = ("",)
) -> tuple[int, int]:
    """How many findings, and how many files that could be read in spite of their damage."""
    seeds = [one for one in sound_files.seeds(name, folder) if one[0].endswith(only)]
    companion, _ = sound_files.companion_grains(name)
    findings = answers = 0
    for number in range(runs):
        own, data = random.choice(seeds)
        # beside sound files, which lists may name; decompressed copies are kept by their names
        path = folder / f"{number % 50}_{own}"
        path.write_bytes(fuzzing.mutate(data, random))
        options = fuzzing.OPTIONS[0] if random.random() < 0.5 else random.choice(fuzzing.OPTIONS)
        began = time.monotonic()
        try:
            with fuzzing.only_scanfabs_warnings():
                answers += read(path, name, options, companion)
            if time.monotonic() - began > SECONDS:
                raise fuzzing.ForbiddenError(f"slow: {time.monotonic() - began:.0f} s")
        except (Exception, SystemExit):
            findings += 1
            OUT.mkdir(exist_ok=True)
            (OUT / f"{name}_{number}_{own}").write_bytes(path.read_bytes())
            (OUT / f"{name}_{number}_{own}.report").write_text(traceback.format_exc())
        path.unlink()
    return findings, answers


def read(path: Path, name: str, options, companion: GrainTable) -> bool:
    """All that a reader is asked of a file; whether there are grains in it."""
    path = sound_files.entry(name, path)
    reader = reader_named(name, options)
    try:
        reader.recognises(path)
        if reader.kind(path) == "contacts":
            for snapshot in reader.snapshots(path)[-1:]:
                reader.read_contacts(snapshot, options, companion)
            return True
        for snapshot in reader.snapshots(path)[-2:]:
            table = reader.read_grains(snapshot, options)
            Packing(table.position, table.radius, id=table.id, cell=table.cell)
    except ScanfabError:
        return False
    return True


if __name__ == "__main__":
    main()

"""
What damaged files give: an error, a warning, or other values in silence; by two versions.

    python tests/campaigns/mutate_readers.py [--base COMMIT] [--runs 40] [--seed 0] [READER ...]

Each small sound file of each format is cut at random places, and has bytes or words of it changed.
Each damaged file is read by the base version, installed as in same_tables.py, and by the version
beside this interpreter. Counted is what is read without an error and without a warning, with other
values than the sound file. Tracebacks, crashes, readings of more than 10 s, cut files that are read
in silence, and files that only this version reads in silence, are listed and kept in the folder
`mutate_findings`. One line for each format and kind of damage; exit code 1 if this version reads
more in silence than the base, or fails.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections import Counter
from itertools import cycle
from pathlib import Path
from random import Random
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
# in the place of this folder, whose coverage.py is not the package of that name
sys.path[0] = str(ROOT)

from scanfab.base.errors import ScanfabError  # noqa: E402
from scanfab.io.reader import reader_named  # noqa: E402
from tests.helpers import fuzzing, sound_files, versions  # noqa: E402
from tests.helpers.versions import Answer, Reading  # noqa: E402

OUT = Path("mutate_findings")
KINDS = ("cut", "bytes", "words", "numbers")


class Damaged(NamedTuple):
    """A file of a format with a kind of damage, or "sound"; and how the sound file is called."""

    path: Path
    format: str
    kind: str
    sound: Path
    grains: Path | None
    """The sound grains, if this is a file of contacts."""

    @property
    def reading(self) -> Reading:
        """How it is read: contacts with sound grains."""
        if self.grains is None:
            return Reading(str(self.path), {"format": self.format})
        return Reading(str(self.grains), {"contacts": str(self.path)})


def damaged_files(folder: Path, runs: int, seed: int, readers: list[str]) -> list[Damaged]:
    """Sound and damaged files of each format."""
    random, made = Random(seed), []
    for name in readers or fuzzing.READERS:
        (folder / name).mkdir()
        _, family = sound_files.companion_grains(name)
        for file, content in sound_files.seeds(name, folder / name):
            path = folder / name / file
            path.write_bytes(content)
            try:
                is_contacts = reader_named(name).kind(path) == "contacts"
            except ScanfabError:
                continue
            grains = family.files[1] if is_contacts else None
            made.append(Damaged(path, name, "sound", path, grains))
            for number, kind in zip(range(runs), cycle(KINDS), strict=False):
                # a digit would be the step of the file
                letters = "".join("abcdefghij"[int(digit)] for digit in str(number))
                own = path.with_name(f"{kind}-{letters}_{file}")
                own.write_bytes(fuzzing.damaged(content, kind, random))
                made.append(Damaged(own, name, kind, path, grains))
    return made


def main() -> None:
    """Damage, read by both versions, count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*")
    parser.add_argument("--base", default=versions.BASE)
    parser.add_argument("--keep", type=Path, default=ROOT / "build" / "same_tables")
    parser.add_argument("--runs", type=int, default=40, help="damages of each file")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    base = versions.installed_base(given.base, given.keep.resolve())
    with tempfile.TemporaryDirectory() as folder:
        made = damaged_files(Path(folder), given.runs, given.seed, given.readers)
        readings = [one.reading for one in made]
        before, after = (versions.answers(x, readings) for x in (base, Path(sys.executable)))
        sys.exit(report(made, before, after))


def report(made: list[Damaged], before: list[Answer], after: list[Answer]) -> bool:
    """Print the counts; whether this version is worse."""
    pairs = list(zip(made, zip(before, after, strict=True), strict=True))
    sound = {one.path: pair for one, pair in pairs if one.kind == "sound"}
    total, silent, worse = Counter(), (Counter(), Counter()), False
    for one, pair in pairs:
        if one.kind == "sound":
            continue
        group = f"{one.format} {one.kind}"
        total[group] += 1
        was_silent, is_silent = (
            isinstance(x.found, list) and not x.warned and x.found != whole.found
            for x, whole in zip(pair, sound[one.sound], strict=True)
        )
        silent[0][group] += was_silent
        silent[1][group] += is_silent
        fault = ""
        if pair[1].is_failure:
            worse, fault = True, pair[1].found
        elif is_silent and (one.kind == "cut" or isinstance(pair[0].found, str) or pair[0].warned):
            fault = f"read in silence, before: {str(pair[0].found)[:20]}"
        if fault:
            print(f"{one.format}: {one.path.name}: {fault}")
            OUT.mkdir(exist_ok=True)
            shutil.copy(one.path, OUT / f"{one.format}_{one.path.name}")
    for group, number in total.items():
        was, now = (count[group] for count in silent)
        worse = worse or now > was
        print(f"{group}: {number} files, silent {was} -> {now}", flush=True)
    print(f"all: {total.total()} files, silent {silent[0].total()} -> {silent[1].total()}")
    return worse


if __name__ == "__main__":
    main()

"""
What damaged files give: an error, a warning, or other values in silence; by two versions.

    python tests/campaigns/mutate_readers.py [--base COMMIT] [--runs 40] [--seed 0] [READER ...]

Each small sound file of each format is cut at random places, and has bytes or words of it changed.
Each damaged file is read by the base version, checked out as in same_tables.py, and by the version
beside this interpreter. Counted is what is read without an error and without a warning, with other
values than the sound file. Tracebacks, crashes, readings of more than 10 s, cut files that are read
in silence, and files that only this version reads in silence, are listed and kept in the folder
`mutate_findings`. One line for each format and kind of damage; exit code 1 if this version reads
more in silence than the base, or fails.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
# in the place of this folder, whose coverage.py is not the package of that name; the base's tree
# where its helpers do the damage
sys.path[:1] = [str(Path.cwd()), str(ROOT)]

from tests.helpers import versions  # noqa: E402

SECONDS = 10
OUT = Path("mutate_findings")


class Damaged(NamedTuple):
    """A damaged file, and how it is read."""

    path: str
    sound: str
    format: str
    kind: str
    """cut, bytes or words; or sound."""
    grains: str | None
    """The sound grains, if this is a file of contacts."""


def task_damage(folder: str, runs: int, seed: int, readers: list[str]) -> list[Damaged]:
    """Sound and damaged files of each format; run in the tree and environment of the base."""
    from scanfab.base.errors import ScanfabError
    from tests.helpers import fuzzing, sound_files
    from tests.helpers.fuzzing import reader_named

    kinds = {
        "cut": fuzzing._cut,
        "bytes": fuzzing._overwrite,
        "words": fuzzing._replace_word,
        "numbers": fuzzing._replace_number,
    }
    random, made = Random(seed), []
    for name in readers or fuzzing.READERS:
        sound = Path(folder) / name
        sound.mkdir(parents=True)
        _, family = sound_files.companion_grains(name)
        companion = next(iter(family.files.values()))
        for file, content in sound_files.seeds(name, sound):
            path = sound / file
            path.write_bytes(content)
            try:
                grains = str(companion) if reader_named(name).kind(path) == "contacts" else None
            except ScanfabError:
                continue
            made.append(Damaged(str(path), str(path), name, "sound", grains))
            for number in range(runs):
                kind = list(kinds)[number % len(kinds)]
                # a digit would be the step of the file
                letters = "".join("abcdefghij"[int(digit)] for digit in str(number))
                own = sound / f"{kind}-{letters}_{file}"
                own.write_bytes(kinds[kind](content, random))
                made.append(Damaged(str(own), str(path), name, kind, grains))
    return made


def task_read(listed: list[list[Any]]) -> None:
    """Read each file; one line of JSON each: its digest, or how it ended."""
    # the package of this interpreter, not that of this tree
    del sys.path[:2]
    import scanfab

    def too_long(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, too_long)
    for one in map(Damaged._make, listed):
        signal.alarm(SECONDS)
        # compiled code sees no signal: the process ends
        faulthandler.dump_traceback_later(2 * SECONDS, exit=True)
        source, options = one.path, {"format": one.format}
        if one.grains is not None:
            source, options = one.grains, {"contacts": one.path}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                frames = [
                    versions.packed(frame.read())
                    for frame in scanfab.read_series(source, **options)
                ]
                told = any(issubclass(w.category, scanfab.ScanfabWarning) for w in caught)
                answer = "warned" if told else json.dumps(frames)
            except scanfab.ScanfabError:
                answer = "refused"
            except BaseException as error:
                answer = f"FAILED {type(error).__name__}: {error}"[:200]
        signal.alarm(0)
        faulthandler.cancel_dump_traceback_later()
        print(json.dumps(answer), flush=True)


def answers(python: Path, listed: list[Damaged]) -> list[str]:
    """How each reading ended; a process that dies is followed by another, behind its file."""
    found: list[str] = []
    while len(found) < len(listed):
        done = subprocess.run(
            [python, __file__, "--task", "read"], input=json.dumps(listed[len(found) :]),
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT, check=False,
        )  # fmt: skip
        found += map(json.loads, done.stdout.splitlines())
        if done.returncode:
            found.append(f"FAILED the process ended with {done.returncode}")
    return found


def main() -> None:
    """Damage, read by both versions, count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*")
    parser.add_argument("--base", default=versions.BASE)
    parser.add_argument("--keep", type=Path, default=ROOT / "build" / "same_tables")
    parser.add_argument("--runs", type=int, default=40, help="damages of each file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--task", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.task == "read":
        task_read(json.load(sys.stdin))
        return
    if given.task == "damage":
        print(json.dumps(task_damage(*json.load(sys.stdin))))
        return
    checkout, base = versions.installed_base(given.base, given.keep.resolve())
    with tempfile.TemporaryDirectory() as folder:
        words = (folder, given.runs, given.seed, given.readers)
        made = versions.ask(base, __file__, "damage", *words, tree=checkout)
        listed = [Damaged._make(one) for one in made]
        before, after = (answers(python, listed) for python in (base, Path(sys.executable)))
        sys.exit(report(listed, before, after))


def report(listed: list[Damaged], before: list[str], after: list[str]) -> bool:
    """Print the counts; whether this version is worse."""
    pairs = list(zip(listed, zip(before, after, strict=True), strict=True))
    sound = {one.path: pair for one, pair in pairs if one.kind == "sound"}
    total, silent, worse = Counter(), (Counter(), Counter()), False
    for one, pair in pairs:
        if one.kind == "sound":
            continue
        group, name = f"{one.format} {one.kind}", Path(one.path).name
        total[group] += 1
        # read, with other values than the sound file
        hidden = [pair[k][:1] == "[" and pair[k] != sound[one.sound][k] for k in (0, 1)]
        for k in (0, 1):
            silent[k][group] += hidden[k]
        fault = ""
        if pair[1].startswith("FAILED"):
            worse, fault = True, pair[1]
        elif hidden[1] and (one.kind == "cut" or pair[0][:1] != "["):
            fault = f"read in silence, before: {pair[0][:7]}"
        if fault:
            print(f"{one.format}: {name}: {fault}")
            OUT.mkdir(exist_ok=True)
            shutil.copy(one.path, OUT / f"{one.format}_{name}")
    for group, number in total.items():
        one, two = (count[group] for count in silent)
        worse = worse or two > one
        print(f"{group}: {number} files, silent {one} -> {two}", flush=True)
    print(f"all: {total.total()} files, silent {silent[0].total()} -> {silent[1].total()}")
    return worse


if __name__ == "__main__":
    main()

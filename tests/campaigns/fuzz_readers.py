"""
Coverage-guided fuzzing of the readers; not part of the test suite.

    pip install atheris
    python tests/campaigns/fuzz_readers.py --runs 200000 [--out FOLDER] [READER ...]

All readers by default. One line for each reader at the end; inputs that broke it stand in the
folder, each with what happened beside it. One process fuzzes until it breaks, or grows old, and
another then goes on with the corpus that it leaves.
"""

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

ROOT = Path(__file__).resolve().parents[2]
# in the place of this folder, whose coverage.py is not the package of that name
sys.path[0] = str(ROOT)

SECONDS, MEGABYTES = 10, 1024
# executions of one process: what atheris' tracing leaks stays below the limit of memory
RUNS_OF_A_PROCESS = 5_000
LONGEST = 20_000
KEPT_OF_A_KIND = 3
RAM = Path("/dev/shm")


def main() -> None:
    """The processes of each reader, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("readers", nargs="*", metavar="READER", default=[])
    parser.add_argument("--runs", type=int, default=200_000, help="executions of each reader")
    parser.add_argument("--out", type=Path, default=Path("fuzz_findings"))
    parser.add_argument("--process", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.process is not None:
        fuzz(given.readers[0], given.runs, given.out, given.process)
        return
    from tests.helpers.fuzzing import READERS

    for reader in given.readers or READERS:
        supervise(reader, given.runs, given.out / reader)


def supervise(reader: str, runs: int, out: Path) -> None:
    """Fuzz one reader, with a new process after each that ends; print the summary."""
    out.mkdir(parents=True, exist_ok=True)
    began, done, ended = time.monotonic(), 0, 0
    with tempfile.TemporaryDirectory(dir=RAM if RAM.is_dir() else None) as name:
        folder = Path(name)
        (folder / "corpus").mkdir()
        while done < runs:
            (folder / "count").write_text("0")
            chunk = min(runs - done, RUNS_OF_A_PROCESS)
            command = [sys.executable, __file__, reader, f"--runs={chunk}", f"--out={out}"]
            with open(out / "log.report", "ab") as log:
                code = subprocess.call([*command, f"--process={folder}"], stdout=log, stderr=log)
            executed = int((folder / "count").read_text())
            done, ended = done + executed, ended + (code != 0)
            if executed == 0:
                sys.exit(f"{reader}: the process ends at once, see {out / 'log.report'}")
    findings = sorted(path.name for path in out.iterdir() if path.suffix != ".report")
    kinds = {name.partition("-")[0] for name in findings}
    print(
        f"{reader}: {done} executions, {time.monotonic() - began:.0f} s, {ended} processes broken, "
        f"{len(kinds)} kinds of findings in {len(findings)} inputs",
        flush=True,
    )


def fuzz(reader: str, runs: int, out: Path, folder: Path) -> None:
    """Fuzz in this process until it has made its runs, or breaks."""
    import atheris

    with atheris.instrument_imports(include=["scanfab", "meshio.vtk", "meshio.vtu", "meshio.xdmf"]):
        from scanfab.io.reader import installed_readers
        from tests.helpers import fuzzing, sound_files

        installed_readers()
    _write_corpus(fuzzing, sound_files, reader, folder)
    sound_files.companion_grains(reader)
    # the libraries that the first table loads take 1 GB of addresses, whatever stands in it
    table = folder / "table.csv"
    table.write_text("x,y,z,radius\n0,0,0,1\n")
    fuzzing.read_everything(table, "table", fuzzing.OPTIONS[0])
    execution = _Execution(fuzzing, reader, out, folder)

    def mutate(data: bytes, most: int, seed: int) -> bytes:
        random = Random(seed)
        if random.random() < 0.25:
            return atheris.Mutate(data, most)
        head = bytes(
            [random.randrange(256) if random.random() < 0.1 else byte for byte in data[:2]]
        )
        return (head + fuzzing.mutate(data[2:], random))[:most]

    arguments = [f"-runs={runs}", f"-timeout={SECONDS}", f"-rss_limit_mb={MEGABYTES}"]
    arguments += [f"-max_len={LONGEST}", f"-artifact_prefix={out}/process.", f"{folder}/corpus"]
    atheris.Setup([sys.argv[0], *arguments], execution, custom_mutator=mutate)
    atheris.Fuzz()


def _write_corpus(fuzzing, sound_files, reader: str, folder: Path) -> None:
    """Two bytes before each file choose its ending and the options; they mutate as well."""
    (folder / "seeds").mkdir(exist_ok=True)
    if any((folder / "corpus").iterdir()):
        return
    endings = [Path(name).suffix for name in fuzzing.NAMES]
    for number, (name, data) in enumerate(sound_files.seeds(reader, folder / "seeds")):
        suffix = Path(name).suffix
        place = endings.index(suffix) if suffix in endings else 0
        (folder / "corpus" / f"seed_{number}").write_bytes(bytes([place, 0]) + data)


class _Execution:
    """What is done with each input."""

    def __init__(self, fuzzing, reader: str, out: Path, folder: Path) -> None:
        self.fuzzing, self.reader, self.out, self.folder = fuzzing, reader, out, folder
        self.counter = os.open(folder / "count", os.O_WRONLY)
        self.printed = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115
        self.count = 0

    def __call__(self, data: bytes) -> None:
        fuzzing = self.fuzzing
        self.count += 1
        os.pwrite(self.counter, b"%20d" % self.count, 0)
        if len(data) < 2:
            return
        name = fuzzing.NAMES[data[0] % len(fuzzing.NAMES)]
        # beside sound files, which lists may name; decompressed copies are kept by their names
        path = self.folder / "seeds" / name.replace("f_1", f"f_{self.count % 1000}")
        path.write_bytes(data[2:])
        options = fuzzing.OPTIONS[data[1] % len(fuzzing.OPTIONS)]
        began = time.monotonic()
        try:
            with _silence(self.printed) as said:
                fuzzing.read_everything(path, self.reader, options)
            if said:
                raise fuzzing.ForbiddenError(f"printed: {said[0][:200]!r}")
            if time.monotonic() - began > SECONDS / 2:
                raise fuzzing.ForbiddenError("slow")
        except (Exception, SystemExit) as error:
            _keep(self.out, data, path.suffix, error)
        finally:
            path.unlink()


def _keep(out: Path, data: bytes, suffix: str, error: BaseException) -> None:
    """The input and the traceback, unless there are enough of that kind."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "/scanfab/" in frame.filename]
    place = f"{Path(own[-1].filename).stem}_{own[-1].lineno}" if own else ""
    if not own:
        # what was printed or warned of: numbers and names in the message differ
        words = str(error).replace("_", " ").split()
        place = "_".join("".join(filter(str.isalpha, word)) for word in words[:5])
    kind = f"{type(error).__name__}_{place}"
    if len(list(out.glob(f"{kind}-*{suffix}"))) >= KEPT_OF_A_KIND:
        return
    target = out / f"{kind}-{hashlib.sha1(data).hexdigest()[:8]}{suffix}"
    target.write_bytes(data[2:])
    text = "".join(traceback.format_exception(error))
    target.with_name(target.name + ".report").write_text(
        f"options {data[1]}, ending {suffix}\n{text}"
    )


@contextmanager
def _silence(file) -> Iterator[list[bytes]]:
    """What Python or C++ prints meanwhile is listed."""
    said: list[bytes] = []
    kept = {number: os.dup(number) for number in (1, 2)}
    for number in kept:
        os.dup2(file.fileno(), number)
    try:
        yield said
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, copy in kept.items():
            os.dup2(copy, number)
            os.close(copy)
        file.seek(0)
        said += filter(None, [file.read()])
        file.truncate(0)


if __name__ == "__main__":
    main()

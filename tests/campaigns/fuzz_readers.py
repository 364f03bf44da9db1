"""
Coverage-guided fuzzing of the readers; not part of the test suite.

    pip install atheris
    python tests/campaigns/fuzz_readers.py --runs 200000 [--out FOLDER] [READER ...]

All readers by default. One line for each reader at the end; inputs that broke it stand in the
folder, each with what happened beside it. One process fuzzes until it breaks, or grows old, and
another then goes on with the corpus that it leaves.
"""

import hashlib
import os
import sys
import tempfile
import time
import traceback
from multiprocessing import get_context
from pathlib import Path
from random import Random
from typing import Any

import click

# in the place of this folder, whose coverage.py is not the package of that name
sys.path[0] = str(Path(__file__).resolve().parents[2])

SECONDS, MEGABYTES = 10, 1024
# executions of one process: what atheris' tracing leaks stays below the limit of memory
RUNS_OF_A_PROCESS = 5_000
LONGEST = 20_000
KEPT_OF_A_KIND = 3
RAM, LOG = Path("/dev/shm"), "log.report"


@click.command(help=__doc__)
@click.argument("readers", nargs=-1, metavar="[READER ...]")
@click.option("--runs", default=200_000, help="executions of each reader")
@click.option("--out", type=click.Path(path_type=Path), default="fuzz_findings")
def main(readers: tuple[str, ...], runs: int, out: Path) -> None:
    """The processes of each reader, one after the other."""
    from tests.helpers.fuzzing import READERS

    for reader in readers or READERS:
        supervise(reader, runs, out / reader)


def supervise(reader: str, runs: int, out: Path) -> None:
    """Fuzz one reader, with a new process after each that ends; print the summary."""
    out.mkdir(parents=True, exist_ok=True)
    began, broken, spawn = time.monotonic(), 0, get_context("spawn")
    done = spawn.Value("L", 0, lock=False)
    with tempfile.TemporaryDirectory(dir=RAM if RAM.is_dir() else None) as folder:
        while (before := done.value) < runs:
            chunk = min(runs - before, RUNS_OF_A_PROCESS)
            process = spawn.Process(target=fuzz, args=(reader, chunk, out, Path(folder), done))
            process.start()
            process.join()
            broken += process.exitcode != 0
            if done.value == before:
                sys.exit(f"{reader}: the process ends at once, see {out / LOG}")
    findings = [path.name for path in out.iterdir() if path.suffix != ".report"]
    kinds = {name.partition("-")[0] for name in findings}
    print(
        f"{reader}: {done.value} executions, {time.monotonic() - began:.0f} s, "
        f"{broken} processes broken, {len(kinds)} kinds of findings in {len(findings)} inputs",
        flush=True,
    )


def fuzz(reader: str, runs: int, out: Path, folder: Path, done: Any) -> None:
    """Fuzz in this process until it has made its runs, or breaks."""
    import atheris

    # what Python or C++ prints goes there, and is read again
    log, printed = (out / LOG).open("ab"), (out / LOG).open("rb")
    for stream in (sys.stdout, sys.stderr):
        os.dup2(log.fileno(), stream.fileno())
    with atheris.instrument_imports(include=["scanfab", "meshio.vtk", "meshio.vtu", "meshio.xdmf"]):
        from scanfab.io.reader import installed_readers
        from tests.helpers import fuzzing, sound_files

        installed_readers()
    (folder / "seeds").mkdir(exist_ok=True)
    if not (folder / "corpus").exists():
        write_corpus(sound_files.seeds(reader, folder / "seeds"), fuzzing.NAMES, folder / "corpus")
    sound_files.companion_grains(reader)
    # the libraries that the first table loads take 1 GB of addresses, whatever stands in it
    table = folder / "table.csv"
    table.write_text("x,y,z,radius\n0,0,0,1\n")
    fuzzing.read_everything(table, "table", fuzzing.OPTIONS[0])

    def mutate(data: bytes, most: int, seed: int) -> bytes:
        random = Random(seed)
        if random.random() < 0.25:
            return atheris.Mutate(data, most)
        head = (random.randrange(256) if random.random() < 0.1 else byte for byte in data[:2])
        return (bytes(head) + fuzzing.mutate(data[2:], random))[:most]

    def execute(data: bytes) -> None:
        done.value += 1
        if len(data) < 2:
            return
        name = fuzzing.NAMES[data[0] % len(fuzzing.NAMES)]
        # beside sound files, which lists may name; decompressed copies are kept by their names
        path = folder / "seeds" / name.replace("f_1", f"f_{done.value % 1000}")
        path.write_bytes(data[2:])
        began = time.monotonic()
        printed.seek(0, os.SEEK_END)
        try:
            fuzzing.read_everything(path, reader, fuzzing.OPTIONS[data[1] % len(fuzzing.OPTIONS)])
            sys.stdout.flush()
            if said := printed.read(200):
                raise fuzzing.ForbiddenError(f"printed: {said!r}")
            if time.monotonic() - began > SECONDS / 2:
                raise fuzzing.ForbiddenError("slow")
        except (Exception, SystemExit) as error:
            keep(out, data, path.suffix, error)
        finally:
            path.unlink()

    arguments = [f"-runs={runs}", f"-timeout={SECONDS}", f"-rss_limit_mb={MEGABYTES}"]
    arguments += [f"-max_len={LONGEST}", f"-artifact_prefix={out}/process.", f"{folder}/corpus"]
    atheris.Setup([sys.argv[0], *arguments], execute, custom_mutator=mutate)
    atheris.Fuzz()


def write_corpus(seeds: list[tuple[str, bytes]], names: tuple[str, ...], corpus: Path) -> None:
    """Two bytes before each file choose its ending and the options; they mutate as well."""
    corpus.mkdir()
    endings = [Path(name).suffix for name in names]
    for number, (name, data) in enumerate(seeds):
        suffix = Path(name).suffix
        place = endings.index(suffix) if suffix in endings else 0
        (corpus / f"seed_{number}").write_bytes(bytes([place, 0]) + data)


def keep(out: Path, data: bytes, suffix: str, error: BaseException) -> None:
    """The input and the traceback, unless there are enough of that kind."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if "/scanfab/" in frame.filename]
    if own:
        place = f"{Path(own[-1].filename).stem}_{own[-1].lineno}"
    else:
        # what was printed or warned of: numbers and names in the message differ
        words = str(error).replace("_", " ").split()
        place = "_".join("".join(filter(str.isalpha, word)) for word in words[:5])
    kind = f"{type(error).__name__}_{place}"
    if len(list(out.glob(f"{kind}-*{suffix}"))) < KEPT_OF_A_KIND:
        target = out / f"{kind}-{hashlib.sha1(data).hexdigest()[:8]}{suffix}"
        target.write_bytes(data[2:])
        text = "".join(traceback.format_exception(error))
        report = target.with_name(f"{target.name}.report")
        report.write_text(f"options {data[1]}, ending {suffix}\n{text}")


if __name__ == "__main__":
    main()

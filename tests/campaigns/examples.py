"""
The examples that YADE, LAMMPS and LIGGGHTS ship, from their default output to a report.

Usage, from the root of the repository (some minutes; needs Debian's yade, lammps, lammps-examples
and liggghts)::

    python -m tests.campaigns.examples FOLDER [PROGRAM]

Each program runs its example in a folder of its own, unless that folder is there. Then scanfab
computes the folder as it lies to a table, a figure, a map and a report; PROGRAM is the command to
call, if it is not this checkout's. A row for each command: seconds, exit code, lines on standard
error.
"""

import argparse
import subprocess
import time
from pathlib import Path

from tests.helpers.interruptions import PROGRAM

DECKS = Path(__file__).parent / "decks"
POUR = Path("/usr/share/lammps/examples/pour/in.pour")
TRIAXIAL = Path("/usr/share/doc/yade/examples/triax-tutorial/script-session1.py")
DUMP = "dump grains all custom 1000 dump.*.pour id type x y z radius\nrun"
MAKERS = {
    "pour": ("lmp", "-in", "in.pour"),
    "packing": ("liggghts", "-in", str(DECKS / "in.packing")),
    "triaxial": ("yade", "-n", "-x", "-j1", "triaxial.py"),
}
COMMANDS = {
    "table and figure": ("compute", "{0}", "-o", "{0}.csv", "--plot", "{0}.png"),
    "map": ("map", "{0}", "--slices", "5", "--frames", "-1:", "-o", "{0}_map.csv"),
    "report": ("report", "{0}.csv", "-o", "{0}.html"),
}


def made(folder: Path, name: str) -> None:
    """Run an example in a folder of its name."""
    (folder / name).mkdir()
    if name == "pour":
        # the example's own dump has no radii; the first `run` comes behind our dump
        text = POUR.read_text("utf-8").replace("\nrun", f"\n{DUMP}", 1)
        (folder / name / "in.pour").write_text(text, "utf-8")
    if name == "triaxial":
        # the example's own steps are comments, and its windows need a screen
        text = TRIAXIAL.read_text("utf-8").partition("if nRead == 0:")[0]
        steps = (DECKS / "triaxial.py").read_text("utf-8")
        (folder / name / "triaxial.py").write_text(text + steps, "utf-8")
    with open(folder / f"{name}.log", "w") as log:
        subprocess.run(MAKERS[name], cwd=folder / name, stdout=log, stderr=log, check=True)


def main(folder: Path, program: list[str]) -> None:
    """Make what is missing, and print a row for each command."""
    folder.mkdir(parents=True, exist_ok=True)
    print("example   command            seconds  exit  lines")
    for name in MAKERS:
        if not (folder / name).exists():
            made(folder, name)
        for what, words in COMMANDS.items():
            command, begun = [*program, *(word.format(name) for word in words)], time.monotonic()
            ended = subprocess.run(command, cwd=folder, stderr=subprocess.PIPE, text=True)
            seconds, lines = time.monotonic() - begun, len(ended.stderr.splitlines())
            (folder / f"{name}_{words[0]}.err").write_text(ended.stderr, "utf-8")
            print(f"{name:9} {what:18} {seconds:7.1f}  {ended.returncode:4}  {lines:5}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Examples of programs, to a report.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("program", nargs="*", default=PROGRAM)
    main(**vars(parser.parse_args()))

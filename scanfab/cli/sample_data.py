"""scanfab sample-data: small real series to try the examples on."""

from __future__ import annotations

import shutil
from pathlib import Path

import click

import scanfab
from scanfab.base.errors import note
from scanfab.base.files import named_errors
from scanfab.cli.console import Command


@click.command("sample-data", cls=Command)
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
def sample_data(folder: Path) -> int:
    """
    Copy small real series to the folder DIR, to try the examples on.

    DIR is a new or an empty folder. The examples of the documentation run where it is named
    sample_data.
    """
    package = Path(scanfab.__file__).parent
    # a wheel holds the series; a checkout has them beside the package
    places = (package / "_samples", package.parent / "sample_data")
    samples = next((place for place in places if place.is_dir()), None)
    if samples is None:
        raise scanfab.ScanfabError(f"{places[0]}: the samples are missing: install scanfab again")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise click.UsageError(f"{folder}: holds something already: name a new or an empty folder")
    # pip compiles the scripts among the samples
    paths = [path for path in samples.rglob("*") if path.parent.name != "__pycache__"]
    for source in sorted(path for path in paths if path.is_file()):
        target = folder / source.relative_to(samples)
        with named_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
    names = ", ".join(sorted(path.name for path in folder.iterdir()))
    note(
        f"copied {names} to {folder}: try scanfab compute {folder}/yade_triaxial --boundary mask=3"
    )
    return 0

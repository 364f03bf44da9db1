"""scanfab sample-data: small real series to try the examples on."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import click

import scanfab
from scanfab.base.errors import SettingsError, note
from scanfab.base.files import check_folder, named_errors
from scanfab.cli.console import Command
from scanfab.cli.options import usage_errors


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
    with usage_errors():
        _check_target(folder)
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


def _check_target(folder: Path) -> None:
    """Raise SettingsError unless the folder is empty, or can be made."""
    if not folder.exists():
        check_folder(folder)
    elif not folder.is_dir():
        raise SettingsError(f"{folder}: is a file: name a new or an empty folder")
    elif any(folder.iterdir()):
        raise SettingsError(f"{folder}: is not empty: name a new or an empty folder")
    elif not os.access(folder, os.W_OK):
        raise SettingsError(f"{folder}: the folder cannot be written to")

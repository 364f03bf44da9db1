"""scanfab formats lists every installed reader and writer."""

from __future__ import annotations

from click.testing import CliRunner

from scanfab.cli.formats import formats
from scanfab.io.reader import installed_readers


def test_every_reader_is_listed_with_its_package() -> None:
    printed = CliRunner().invoke(formats, []).stdout.splitlines()
    for name, installed in installed_readers().items():
        line = next(line for line in printed if line.split()[:2] == ["reader", name])
        assert installed.package in line
        assert all(one in line for one in installed.plugin.extensions[:1])


def test_csv_is_a_writer() -> None:
    printed = CliRunner().invoke(formats, []).stdout.splitlines()
    assert any(line.split()[:2] == ["writer", "csv"] for line in printed)

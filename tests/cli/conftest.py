"""A command of scanfab as tests ask for it, and a series that most of them read."""

import csv
import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from scanfab.cli.main import run
from tests.helpers.interruptions import write_series


class Answer(NamedTuple):
    """What a command printed."""

    out: str
    err: str

    @property
    def rows(self) -> list[dict[str, str]]:
        """Of CSV on standard output."""
        return list(csv.DictReader(io.StringIO(self.out)))

    @property
    def told(self) -> str:
        """Standard error as one line."""
        return " ".join(self.err.split())


@pytest.fixture
def ask(capsys, monkeypatch) -> Callable[..., Answer]:
    """Run a command that ends with this exit code, and never with a traceback."""

    def call(*words: object, code: int = 0, stdin: bytes = b"") -> Answer:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(stdin)))
        capsys.readouterr()
        assert run([str(word) for word in words]) == code
        answer = Answer(*capsys.readouterr())
        assert "Traceback" not in answer.err
        return answer

    return call


@pytest.fixture(scope="session")
def series(tmp_path_factory) -> Path:
    """A folder of five small frames, which no test changes."""
    return write_series(tmp_path_factory.mktemp("cli") / "series", 5)

"""The documentation is complete and true: names, generated pages, examples, links."""

from __future__ import annotations

import ast
import doctest
import importlib.util
import math
import pkgutil
import re
import shutil
import sys
import warnings
from importlib import import_module
from pathlib import Path
from types import ModuleType

import click
import pytest

import scanfab
from scanfab.base.column import Column, columns_of_fields
from scanfab.cli.group import COMMANDS, cli
from scanfab.io.reader import installed_readers
from scanfab.pipeline import calibration, inspection
from scanfab.scan.directions import RULES
from scanfab.table import compare
from scanfab.table.columns import table_columns
from tests.helpers.docstrings import faults, faults_of

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
MODULES = [
    name
    for _, name, _ in pkgutil.walk_packages(scanfab.__path__, "scanfab.")
    if not name.startswith("scanfab.cli.")
]


def script(name: str) -> ModuleType:
    """A script of the docs, as a module; as when it runs, it finds the modules beside it."""
    if str(DOCS) not in sys.path:
        sys.path.append(str(DOCS))
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_command_line_page_is_fresh() -> None:
    assert (DOCS / "command-line.md").read_text(encoding="utf-8") == script(
        "make_command_line"
    ).page(), "run python docs/make_command_line.py"


def test_the_python_page_is_fresh_and_has_every_public_name_once() -> None:
    python = script("make_python")
    page = (DOCS / "python.md").read_text(encoding="utf-8")
    assert page == python.page(), "run python docs/make_python.py"
    assert sorted(name for group in python.GROUPS.values() for name in group) == sorted(
        scanfab.__all__
    )


def test_the_architecture_page_is_short_and_names_what_there_is() -> None:
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    assert len(text.split()) <= 1000
    package = ROOT / "scanfab"
    for room in [path.parent.name for path in package.glob("*/__init__.py")]:
        assert re.search(rf"^\d .*\b{room}\b", text, re.MULTILINE), room
    for name in re.findall(r"`(\w+/[\w/.]*)`", text):
        assert (package / name).exists(), name


def test_no_file_is_long() -> None:
    for path in (ROOT / "scanfab").rglob("*.py"):
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 400, path


@pytest.mark.parametrize(
    "columns",
    [
        table_columns(),
        compare.FRAMES,
        compare.SUMMARY,
        compare.DIFFERENCES,
        columns_of_fields(calibration.StepRow),
        columns_of_fields(inspection.FrameReport),
    ],
)
def test_every_column_has_a_meaning_and_a_kind_and_stands_on_the_page(
    columns: tuple[Column, ...],
) -> None:
    text = (DOCS / "command-line.md").read_text(encoding="utf-8")
    assert len({column.name for column in columns}) == len(columns)
    for column in columns:
        assert column.kind in (int, float, str, list)
        assert f"| `{column.name}` | {column.unit} | {column.meaning} |" in text
        assert column.meaning


def test_every_reader_rule_and_dependency_is_on_its_page() -> None:
    overview, directions, house = (
        (DOCS / f"{name}.md").read_text("utf-8")
        for name in ("formats", "details/directions-and-errors", "architecture")
    )
    for name in installed_readers():
        assert f"(formats/{name}.md)" in overview
        assert (DOCS / "formats" / f"{name}.md").read_text("utf-8").startswith(f"# {name}\n")
    for name, (_, argument) in RULES.items():
        assert f"`{name}:{argument}`" in directions
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    (listed,) = re.findall(r"\ndependencies = \[(.*?)\]", project, re.DOTALL)
    for name in re.findall(r'"([a-z0-9]+)', listed):
        assert f"| {name} |" in house


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert doctest.testmod(import_module(name)).failed == 0


@pytest.mark.parametrize("name", scanfab.__all__)
def test_every_public_name_says_what_it_takes_and_gives_with_an_example(name: str) -> None:
    assert faults(name) == []


def test_a_docstring_that_does_not_fit_its_signature_is_found() -> None:
    def badly(first: int, second: int, *, third: int = 3) -> int:
        """
        Add

        Parameters
        ----------
        first, third : int
            Numbers.

        Examples
        --------
        Raises
        ------
        NoSuchError
            Never.
        """
        return first + second + third

    found = " ".join(faults_of(badly))
    for fault in (
        "no summary that is a sentence",
        "['first', 'third'], but has or takes ['first', 'second', 'third']",
        "does not say what it returns",
        "no example",
        "another order",
        "NoSuchError",
    ):
        assert fault in found


def python_blocks() -> list[tuple[str, str]]:
    return [
        (page.name, block)
        for page in PAGES
        for block in re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)
    ]


@pytest.mark.parametrize(("page", "block"), python_blocks())
@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_python_in_the_pages_runs(
    page: str, block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sample_data").symlink_to(ROOT / "sample_data")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, page, "exec"), {"__name__": "docs"})


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_every_option_is_documented_and_the_pages_speak_of_no_others() -> None:
    commands = [cli.get_command(click.Context(cli), name) for name in COMMANDS]
    options = {x for one in commands for parameter in one.params for x in parameter.opts}
    text = (DOCS / "command-line.md").read_text("utf-8")
    assert [one for one in options if one.startswith("-") and one not in text] == []
    known = {*options, "--format", "--help", "--version", "--debug"}
    for page in PAGES:
        # what a batch system is told, and scripts of the tests, have options of their own
        text = re.sub(r"#SBATCH .*|sbatch .*|dask .*|`python .*", "", page.read_text("utf-8"))
        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", text):
            assert option in known, f"{page.name}: {option}"


def test_messages_on_their_page_stand_there_once_and_are_those_of_the_program() -> None:
    page = (DOCS / "messages.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\| (`.*?`) \| ", page, re.MULTILINE)
    messages = [text for cell in cells for text in re.findall("`(.*?)`", cell)]
    assert len(messages) > 100
    assert len({*messages}) == len(messages)
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "scanfab").rglob("*.py")]
    nodes = [node for source in sources for node in ast.walk(ast.parse(source))]
    texts = "\n".join(str(node.value) for node in nodes if isinstance(node, ast.Constant))
    for words in (message.split() for message in messages):
        # names and numbers of a case stand between words that are always the same
        runs = [" ".join(words[place : place + 3]) for place in range(max(1, len(words) - 2))]
        is_of_the_system = words[:3] == ["No", "space", "left"]
        assert is_of_the_system or any(run in texts for run in runs), words


def test_the_result_in_the_readme_is_that_of_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    text = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    told = re.search(
        r"α_vs of the RV is ([\d.]+) ± ([\d.]+): ([\d.]+) from having drawn these lines, "
        r"and ([\d.]+) from having these (\d+) grains",
        text,
    )
    assert told is not None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scanfab.ScanfabNote)
        series = scanfab.read_series("sample_data/yade_triaxial")
    row = scanfab.compute(series, boundary="mask=3", frames="-1:")[2]
    scan, sample = row.alpha_vs_axial_se, row.alpha_vs_axial_sample_se
    assert row.variant == "c"
    numbers = [row.alpha_vs_axial, math.hypot(scan, sample), scan, sample]
    assert [f"{one:.5f}" for one in numbers] + [str(row.grains)] == list(told.groups())


def words_and_numbers(text: str) -> tuple[list[str], list[float]]:
    """A text without its numbers, and the numbers: last digits depend on the machine."""
    number = r"(?<![\w.])-?\d+\.\d+(?:e[-+]?\d+)?"
    return re.split(number, text), [float(match) for match in re.findall(number, text)]


@pytest.mark.skipif(shutil.which("bash") is None, reason="the commands are for bash")
@pytest.mark.parametrize("page", script("make_tutorial").pages(), ids=lambda page: page.name)
def test_commands_in_the_pages_run_and_print_what_the_pages_say(page: Path) -> None:
    said = words_and_numbers(page.read_text(encoding="utf-8"))
    now = words_and_numbers(script("make_tutorial").fresh_page(page))
    assert now[0] == said[0], f"run python docs/make_tutorial.py {page.relative_to(ROOT)}"
    assert now[1] == pytest.approx(said[1], rel=1e-6)

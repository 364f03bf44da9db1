"""The documentation is complete and true: names, generated pages, examples, links."""

import ast
import builtins
import doctest
import inspect
import math
import pkgutil
import re
import shutil
import sys
import tomllib
import warnings
from collections.abc import Iterator
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import click
import pytest

import scanfab
from scanfab.cli.group import COMMANDS, cli
from scanfab.cli.main import run
from scanfab.io.reader import installed_readers
from scanfab.pipeline import calibration
from scanfab.scan.directions import RULES
from scanfab.table.columns import table_columns
from scanfab.viz.figures import style

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
sys.path.append(str(DOCS / "make"))
figures, outputs, pages, reference = map(
    import_module, ("figures", "outputs", "pages", "reference")
)
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
MODULES = [
    name
    for _, name, _ in pkgutil.walk_packages(scanfab.__path__, "scanfab.")
    if not name.startswith("scanfab.cli.")
]


@pytest.fixture(scope="module")
def page_texts() -> dict[str, str]:
    """All pages as the site has them: what scripts make stands in its places."""
    return {
        page.relative_to(DOCS).as_posix(): pages.filled(page.read_text("utf-8"))
        for page in PAGES[1:]
    }


def test_every_part_that_scripts_make_is_on_a_page(page_texts: dict[str, str]) -> None:
    asked = [
        name for page in PAGES for name in re.findall(r"\{\{(\w+)\}\}", page.read_text("utf-8"))
    ]
    assert sorted(asked) == sorted(pages.PARTS)
    assert not any("nan" in text.split() for text in page_texts.values())


def test_every_public_name_is_once_in_the_api() -> None:
    text = (DOCS / "api" / "index.md").read_text("utf-8")
    assert sorted(re.findall(r"^   scanfab\.(\w+)$", text, re.MULTILINE)) == scanfab.__all__


def test_the_page_for_developers_names_what_there_is() -> None:
    text = (DOCS / "developers.md").read_text(encoding="utf-8")
    package = ROOT / "scanfab"
    for room in [path.parent.name for path in package.glob("*/__init__.py")]:
        assert re.search(rf"^\d .*\b{room}\b", text, re.MULTILINE), room
    for name in re.findall(r"`(\w+/[\w/.]*)`", text):
        assert (package / name).exists() or (ROOT / name).exists(), name


def test_no_file_is_long() -> None:
    for path in (ROOT / "scanfab").rglob("*.py"):
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 400, path


def test_every_column_has_a_meaning_and_a_kind_and_stands_on_the_page(
    page_texts: dict[str, str],
) -> None:
    text = page_texts["columns.md"]
    for columns in (table_columns(), *reference.COLUMNS.values()):
        assert len({column.name for column in columns}) == len(columns)
        for column in columns:
            assert column.kind in (int, float, str, list)
            assert column.meaning
            assert f"`{column.name}`" in text, column.name
    # a line has all columns that differ in their component
    names = ", ".join(f"`gvs_{axes}`" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
    assert f"| {names} | void fabric tensor, whose trace is 1 |" in text
    assert "| `p` | mean stress, a third of the trace, for discs half of it (stress) |" in text


def test_every_reader_rule_and_dependency_is_on_its_page(page_texts: dict[str, str]) -> None:
    for name in installed_readers():
        assert f"[`{name}`]({name}.md)" in page_texts["formats/index.md"]
        assert page_texts[f"formats/{name}.md"].startswith(f"# {name}\n")
    directions = page_texts["details/directions-and-errors.md"]
    for name, (_, argument, *_) in RULES.items():
        assert f"`{name}:{argument}`" in directions
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    (listed,) = re.findall(r"\ndependencies = \[(.*?)\]", project, re.DOTALL)
    for name in re.findall(r'"([a-z0-9]+)', listed):
        assert f"| {name} |" in page_texts["developers.md"]


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert doctest.testmod(import_module(name)).failed == 0


def named_in(section: str) -> list[str]:
    """The names that a section describes: those of its lines that are not indented."""
    lines = [line for line in section.splitlines() if line and not line.startswith(" ")]
    names = [line.split(" : ")[0] for line in lines]
    return [name.strip().lstrip("*") for line in names for name in line.split(",")]


def faults_of(thing: Any, with_example: bool = True) -> Iterator[str]:
    """Of a function, method, property or class: what numpydoc or the signature asks for."""
    text = inspect.getdoc(thing) or ""
    parts = re.split(r"^(\w+)\n-{3,}\n", text, flags=re.MULTILINE)
    found = dict(zip(parts[1::2], parts[2::2], strict=True))
    summary = text.split("\n\n")[0].strip()
    if not summary.endswith((".", ":")):
        yield f"has no summary that is a sentence, but {summary!r}"
    for error in named_in(found.get("Raises", "")):
        if not hasattr(scanfab, error) and not hasattr(builtins, error):
            yield f"raises {error}, which is no public error"
    is_class = inspect.isclass(thing)
    is_property = isinstance(thing, property | cached_property)
    if is_property or (is_class and issubclass(thing, Exception)):
        return
    signature = inspect.signature(thing)
    names = [name for name in signature.parameters if name not in ("self", "cls")]
    described = named_in(found.get("Parameters", ""))
    if is_class:
        described += named_in(found.get("Attributes", ""))
        fields = {name for one in thing.__mro__ for name in vars(one).get("__annotations__", {})}
        names += [one for one in described if one in fields or hasattr(thing, one)]
        described, names = sorted(set(described)), sorted(set(names))
    if described != names:
        yield f"describes {described}, but has or takes {names}"
    gives = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    if gives and not is_class and not {"Returns", "Yields"} & set(found):
        yield "does not say what it returns"
    if with_example and ">>>" not in found.get("Examples", ""):
        yield "has no example"


def members_of(kind: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties that a class of this package brings itself."""
    for name, member in inspect.getmembers_static(kind):
        owner = next(one for one in kind.__mro__ if name in vars(one))
        # a field may have a function for its usual value
        if name.startswith("_") or name in vars(owner).get("__annotations__", {}):
            continue
        member = getattr(member, "__func__", member)
        is_code = isinstance(member, property | cached_property) or inspect.isfunction(member)
        if owner.__module__.startswith("scanfab") and is_code:
            yield name, member


def faults(name: str) -> list[str]:
    """Of one public name and all that it brings; empty if there is nothing to mend."""
    named = getattr(scanfab, name)
    if not callable(named):
        return []
    found = [f"{name} {fault}" for fault in faults_of(named)]
    if inspect.isclass(named) and not issubclass(named, Exception):
        for member, value in members_of(named):
            found += [f"{name}.{member} {fault}" for fault in faults_of(value, with_example=False)]
    return found


@pytest.mark.parametrize("name", scanfab.__all__)
def test_every_public_name_says_what_it_takes_and_gives_with_an_example(name: str) -> None:
    assert faults(name) == []


def python_blocks() -> list[tuple[str, str]]:
    """
    The blocks of each page, and the cells of each notebook as one.

    tests/pipeline/test_inside.py runs the pages that need another program.
    """
    found = []
    for page in [page for page in PAGES if not page.name.startswith("inside-")]:
        text = page.read_text("utf-8")
        blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
        cells = re.findall(r"^```\{code-cell\}\n((?:[^:].*\n|\n)*?)```", text, re.M)
        found += [(page.name, block) for block in [*blocks, *(["\n".join(cells)] * bool(cells))]]
    return found


@pytest.mark.parametrize(("page", "block"), python_blocks())
@pytest.mark.filterwarnings("ignore::scanfab.base.errors.ScanfabWarning")
def test_python_in_the_pages_runs(page: str, block: str) -> None:
    with figures.workplace():
        exec(compile(block, page, "exec"), {"__name__": "docs"})


def test_the_commands_of_the_pages_draw_their_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("cut", "view"):
        shutil.copy(figures.FIGURES / f"{name}.png", tmp_path)
    monkeypatch.setattr(figures, "FIGURES", tmp_path)

    def rough(words: list[str]) -> int:
        more = [] if words[0] == "compare" else ["--tolerance", "1e-2"]
        more += ["--frames", "::3"] if words[0] == "compute" and "--frames" not in words else []
        return run([*words, *more])

    monkeypatch.setattr(figures, "run", rough)
    monkeypatch.setattr(calibration, "SPACINGS", calibration.SPACINGS[:3])
    # what is drawn becomes no image: other tests look at images
    monkeypatch.setattr(style, "figure_bytes", lambda *_: b"")
    figures.draw()
    shown = {
        name
        for page in PAGES
        for name in re.findall(r"!\[.*\]\(.*figures/(\S*)\.png\)", page.read_text("utf-8"))
    }
    assert shown <= {path.stem for path in tmp_path.glob("*.png")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_between_pages_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        # figures and tables are made with the site
        if "://" not in target and "figures/" not in target and "tables/" not in target:
            assert (page.parent / target).exists(), target


def test_old_names_of_pages_lead_to_the_new_pages_in_the_repository_and_on_the_site() -> None:
    conf = (DOCS / "conf.py").read_text("utf-8")
    moved = ast.literal_eval(re.findall(r"^redirects = (\{.*?^\})", conf, re.M | re.S)[0])
    assert len(moved) == 9
    for name, target in moved.items():
        text = (DOCS / f"{name}.md").read_text("utf-8")
        assert f"]({target.replace('.html', '.md')})" in text


def test_the_conda_recipe_asks_for_the_packages_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    wanted = [*project["build-system"]["requires"], *project["project"]["dependencies"]]
    wanted = [one.split(";")[0].replace("matplotlib", "matplotlib-base") for one in wanted]
    recipe = (ROOT / ".ci" / "conda" / "recipe.yaml").read_text("utf-8")
    asked = re.findall(r"^    - ([\w.-]+ >=[\d.]+)$", recipe, re.MULTILINE)
    assert sorted(one.replace(" ", "") for one in asked) == sorted(wanted)
    python = project["project"]["requires-python"].removeprefix(">=")
    assert f'python_min: "{python}"' in recipe


def test_every_option_is_documented_once_and_the_pages_speak_of_no_others(
    page_texts: dict[str, str],
) -> None:
    commands = {name: cli.get_command(click.Context(cli), name) for name in COMMANDS}
    text = page_texts["command-line.md"]
    matrix = {line.split("`")[1]: line for line in text.splitlines() if line.startswith("| [`")}
    takers = {
        option: [name for name, one in commands.items() if option in one_options(one)]
        for option in sorted({x for one in commands.values() for x in one_options(one)})
    }
    for option, names in takers.items():
        assert text.count(f"]{{#{option.lstrip('-')}}}") == 1
        cells = matrix[option].split("|")[2:-1]
        assert [name for name, cell in zip(COMMANDS, cells, strict=True) if cell.strip()] == names
    known = {*takers, "--format", "--help", "--version", "--debug"}
    for name, page in {**page_texts, "README.md": PAGES[0].read_text("utf-8")}.items():
        # batch systems, pip and scripts of the tests have options of their own
        own = r"#SBATCH .*|sbatch .*|dask .*|`?python3? .*|ruff .*|apt-get .*|yade .*|lmp .*"
        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", re.sub(own, "", page)):
            assert option in known, f"{name}: {option}"


def one_options(command: click.Command) -> set[str]:
    """The options of a command, as its help spells them."""
    return {one.opts[0] for one in command.params if isinstance(one, click.Option)}


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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scanfab.ScanfabNote)
        series = scanfab.read_series("sample_data/yade_triaxial")
    row = scanfab.compute(series, boundary="mask=3", frames="-1:")[2]
    scan, sample = row.alpha_vs_axial_se, row.alpha_vs_axial_sample_se
    assert row.variant == "c"
    told = (
        f"α_vs of the RV is {row.alpha_vs_axial:.5f} ± {math.hypot(scan, sample):.5f}: {scan:.5f} "
        f"from having drawn these lines, and {sample:.5f} from having these {row.grains} grains"
    )
    assert told in " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())


def words_and_numbers(text: str) -> tuple[list[str], list[float]]:
    """A text without its numbers, and the numbers: last digits depend on the machine."""
    number = r"(?<![\w.])-?\d+\.\d+(?:e[-+]?\d+)?"
    return re.split(number, text), [float(match) for match in re.findall(number, text)]


@pytest.mark.skipif(shutil.which("bash") is None, reason="the commands are for bash")
@pytest.mark.parametrize("page", outputs.pages(), ids=lambda page: page.name)
def test_commands_in_the_pages_run_and_print_what_the_pages_say(page: Path) -> None:
    said = words_and_numbers(page.read_text(encoding="utf-8"))
    now = words_and_numbers(outputs.fresh_page(page))
    assert now[0] == said[0], f"run python docs/make/outputs.py {page.relative_to(ROOT)}"
    assert now[1] == pytest.approx(said[1], rel=1e-6)

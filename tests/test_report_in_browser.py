"""The report in a real browser: it works alone, the view turns, and names are only text."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from scanfab.cli.main import run
from tests.browser import Browser, missing
from tests.conftest import ROOT, SAMPLE

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())

# a file name cannot hold a slash: </script> comes by a column and a setting
HOSTILE = "<img src=x onerror=document.title='hacked'>\"'"
WORSE = HOSTILE + "</script><script>document.title='hacked'</script><!--"
PIXELS = """
const canvas = document.querySelector('canvas.view');
const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
const seen = {};
let hash = 0;
for (let i = 0; i < data.length; i += 4) {
  const colour = (data[i] << 16) | (data[i + 1] << 8) | data[i + 2];
  seen[colour] = (seen[colour] || 0) + 1;
  hash = (31 * hash + colour) | 0;
}
return [hash, seen];
"""
DRAWN = """
return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))));
"""


@pytest.fixture(scope="module")
def browser():
    with Browser() as one:
        yield one


@pytest.fixture(scope="module")
def report(computed, tmp_path_factory):
    """Of a table and a source with hostile names."""
    folder = tmp_path_factory.mktemp("report")
    source = folder / HOSTILE
    source.mkdir()
    for file in (ROOT / SAMPLE).glob("*.vtk.gz"):
        shutil.copy(file, source)
    table = folder / f"{HOSTILE}.csv"
    words = ["compute", str(source), "--boundary", "mask=3", "--tolerance", "1e-3"]
    assert run([*words, "--variants", "cd", "--frames", "0::3", "-o", str(table)]) == 0
    worse = folder / "worse.json"
    rows = [{**row, "source": WORSE, "contacts_from": WORSE} for row in computed.rows]
    worse.write_text(json.dumps(rows))
    manifest = json.loads(Path(f"{computed.table}.manifest.json").read_text())
    manifest["settings"]["sources"] = [WORSE]
    manifest["settings"][WORSE] = WORSE
    manifest["versions"][WORSE] = WORSE
    manifest["warnings"] = [WORSE]
    manifest["inputs"] = [{"path": WORSE, "size": WORSE, "sha256": WORSE}]
    Path(f"{worse}.manifest.json").write_text(json.dumps(manifest))
    page = folder / "report.html"
    before = Path.cwd()
    os.chdir(folder)
    try:
        assert run(["report", table.name, "worse.json", "-o", str(page)]) == 0
    finally:
        os.chdir(before)
    return page


@pytest.fixture
def page(browser, report):
    browser.log("performance")
    browser.log("browser")
    browser.open(report.as_uri())
    browser.run(DRAWN)
    return browser


def test_nothing_is_fetched_and_the_console_is_silent(page, report):
    asked = [url for url in page.requests() if not url.startswith("data:")]
    assert asked == [report.as_uri()]
    assert page.log("browser") == []


def test_every_figure_is_shown(page):
    widths = page.run("return [...document.images].map((image) => image.naturalWidth)")
    assert len(widths) == 5
    assert min(widths) > 300


def test_the_view_has_colours_and_turns_when_dragged(page):
    page.run("document.querySelector('canvas.view').scrollIntoView({block: 'center'})")
    before, colours = page.run(PIXELS)
    assert sum(count > 50 for count in colours.values()) > 20
    box = page.run(
        "const b = document.querySelector('canvas.view').getBoundingClientRect();"
        "return [b.left, b.top, b.width, b.height].map(Math.round)"
    )
    middle = (box[0] + box[2] // 2, box[1] + box[3] // 2)
    page.drag(*middle, 120, 40)
    page.run(DRAWN)
    after, _ = page.run(PIXELS)
    assert after != before
    # back to where it was
    page.drag(middle[0] + 120, middle[1] + 40, -120, -40)
    page.run(DRAWN)
    assert page.run(PIXELS)[0] == before
    # but for advice on how this test reads pixels
    assert [one for one in page.log("browser") if "getImageData" not in one["message"]] == []


def test_the_view_is_cut_open_and_zoomed(page):
    before, _ = page.run(PIXELS)
    page.run("[...document.querySelectorAll('.key input')].at(-1).click()")
    page.run(DRAWN)
    cut, colours = page.run(PIXELS)
    assert cut != before
    # kept and dropped void segments
    assert colours["0"] > 100
    assert colours[str(0xD55E00)] > 20
    wheel = "new WheelEvent('wheel', {deltaY: -300})"
    page.run(f"document.querySelector('canvas.view').dispatchEvent({wheel})")
    page.run(DRAWN)
    assert page.run(PIXELS)[0] != cut


def test_hostile_names_are_text(page):
    assert page.run("return document.title") == "Void fabric report"
    assert page.run("return document.querySelectorAll('img:not([alt])').length") == 0
    assert page.run("return document.scripts.length") == 2
    text = page.run("return document.body.innerText")
    assert HOSTILE in text
    assert text.count(WORSE) >= 5


def test_what_is_not_there_is_said(page):
    text = page.run("return document.body.innerText")
    assert "The view is left out: the source" in text
    assert page.run("return document.querySelectorAll('canvas').length") == 1

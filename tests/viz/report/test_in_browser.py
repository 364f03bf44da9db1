"""The report in a real browser: it works alone, and the view turns."""

import pytest

pytest.importorskip("selenium")

from tests.viz.report.browser import Browser, missing

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())


COLOURS = """
const canvas = document.querySelector('canvas.view');
const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
const seen = {};
for (let i = 0; i < data.length; i += 4) {
  const colour = (data[i] << 16) | (data[i + 1] << 8) | data[i + 2];
  seen[colour] = (seen[colour] || 0) + 1;
}
return seen;
"""
RIGHT = "return document.querySelector('table').getBoundingClientRect().right"
SEEN = """
const picture = () => document.querySelector('canvas.view').toDataURL();
return new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(() => done(picture()))));
"""
MIDDLE = """
document.querySelector('canvas.view').scrollIntoView({block: 'center'});
const box = document.querySelector('canvas.view').getBoundingClientRect();
return [Math.round(box.left + box.width / 2), Math.round(box.top + box.height / 2)];
"""


@pytest.fixture(scope="module")
def browser():
    with Browser() as one:
        yield one


@pytest.fixture(scope="module")
def report(sample_report, tmp_path_factory):
    page = tmp_path_factory.mktemp("report") / "report.html"
    sample_report.save(page)
    return page


@pytest.fixture
def page(browser, report):
    browser.get_log("performance")
    browser.get_log("browser")
    browser.get(report.as_uri())
    browser.run(SEEN)
    return browser


def test_nothing_is_fetched_and_every_figure_is_shown(page, report):
    asked = [url for url in page.requests() if not url.startswith("data:")]
    assert asked == [report.as_uri()]
    assert page.get_log("browser") == []
    widths = page.run("return [...document.images].map((image) => image.naturalWidth)")
    assert len(widths) == 5
    assert min(widths) > 300


def wait_for(page, condition):
    for _ in range(50):
        if page.run(f"return {condition}"):
            return
        page.run(SEEN)
    raise AssertionError(condition)


def test_the_view_has_colours_and_turns_when_dragged(page):
    x, y = page.run(MIDDLE)
    before = page.run(SEEN)
    assert sum(count > 50 for count in page.run(COLOURS).values()) > 20
    page.drag((x, y, 120, 40))
    assert page.run(SEEN) != before
    # back to where it was
    page.drag((x + 120, y + 40, -120, -40))
    assert page.run(SEEN) == before
    # but for advice on how this test reads pixels
    assert [one for one in page.get_log("browser") if "getImageData" not in one["message"]] == []


def test_the_view_is_cut_open_and_zoomed(page):
    before, colours = page.run(SEEN), page.run(COLOURS)
    # kept and dropped void segments, and the disks in which the plane cuts grains
    assert colours["0"] > 100
    assert colours[str(0xD55E00)] > 20
    assert colours[str(0xB4DDF5)] > 5000
    page.run("[...document.querySelectorAll('.key input')].at(-1).click()")
    assert page.run(SEEN) != before
    assert page.run(COLOURS).get(str(0xB4DDF5), 0) < 100


def test_the_wheel_scrolls_the_page_until_the_view_is_clicked(page):
    x, y = page.run(MIDDLE)
    before, top = page.run(SEEN), page.run("return scrollY")
    page.wheel(x, y, 120)
    wait_for(page, f"scrollY > {top}")
    assert page.run(SEEN) == before
    x, y = page.run(MIDDLE)
    page.drag((x, y, 0, 0))
    top = page.run("return scrollY")
    page.wheel(x, y, -120)
    assert page.run(SEEN) != before
    assert page.run("return scrollY") == top


def test_keys_turn_and_zoom_and_r_and_the_button_reset(page):
    before = page.run(SEEN)
    for keys in ("+", "-", "\ue012", "\ue013"):
        page.run("document.querySelector('canvas.view').focus()")
        page.press(keys)
        assert page.run(SEEN) != before
        page.press("r")
        assert page.run(SEEN) == before
        page.press(keys)
        page.run("document.querySelector('.key button').click()")
        assert page.run(SEEN) == before


def test_the_contents_lead_to_the_sections_and_all_fits_the_window(page):
    targets = page.run(
        "return [...document.querySelectorAll('nav a')].map((a) => "
        "document.getElementById(a.hash.slice(1)).textContent === a.textContent)"
    )
    assert len(targets) >= 6
    assert all(targets)
    assert page.run("return document.documentElement.scrollWidth <= innerWidth")
    assert page.run(RIGHT) < 1200


@pytest.fixture(scope="module")
def phone(report):
    with Browser(phone=True) as one:
        one.get(report.as_uri())
        yield one


def test_a_phone_shows_results_without_scrolling_sideways_and_letters_in_their_size(phone):
    assert phone.run("return document.documentElement.scrollWidth") == 390
    assert phone.run(RIGHT) <= 390
    widths = phone.run(
        "return [...document.images].map((one) => one.getBoundingClientRect().width)"
    )
    assert widths == phone.run(
        "return [...document.images].map((one) => Number(one.getAttribute('width')))"
    )


def test_one_finger_scrolls_and_two_turn_and_pinch(phone):
    x, y = phone.run(MIDDLE)
    before, top = phone.run(SEEN), phone.run("return scrollY")
    phone.drag((x - 60, y + 60, 0, -120), kind="touch")
    wait_for(phone, f"scrollY > {top}")
    assert phone.run(SEEN) == before
    x, y = phone.run(MIDDLE)
    top = phone.run("return scrollY")
    phone.drag((x - 60, y - 40, 40, 30), (x + 40, y + 30, 40, 30), kind="touch")
    assert phone.run("return scrollY") == top
    turned = phone.run(SEEN)
    assert turned != before
    phone.drag((x - 30, y - 20, -40, -30), (x + 30, y + 20, 40, 30), kind="touch")
    assert phone.run(SEEN) not in (before, turned)

"""The report in a real browser, Chromium: it works alone, and the view turns."""

import shutil

import pytest

pytest.importorskip("selenium")

from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains, ScrollOrigin
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.pointer_actions import PointerActions
from selenium.webdriver.support.ui import WebDriverWait

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="install chromium and chromium-driver"
)
FLAGS = ("headless=new", "no-sandbox", "disable-dev-shm-usage", "window-size=1200,1000")
PHONE = {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}

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
ELSEWHERE = """
const names = [...document.querySelectorAll('[src], [href]')].map(
  (one) => one.getAttribute('src') || one.getAttribute('href'));
const fetched = performance.getEntriesByType('resource').map((one) => one.name);
return [...names, ...fetched].filter((name) => !/^(data:|#)/.test(name));
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


class Browser(webdriver.Chrome):
    """One window; use it in a with block."""

    run = webdriver.Chrome.execute_script

    def __init__(self):
        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for flag in FLAGS:
            options.add_argument(f"--{flag}")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        super().__init__(options, webdriver.ChromeService(DRIVER))

    def drag(self, *moves, kind="mouse"):
        """Press at each place of the window, by fingers if the kind is touch, move, and let go."""
        actions = ActionBuilder(self)
        for number, (x, y, dx, dy) in enumerate(moves):
            pointer = PointerActions(actions.add_pointer_input(kind, f"{kind} {number}"))
            pointer.move_to_location(x, y).pointer_down()
            pointer.move_to_location(x + dx, y + dy).pointer_up()
        actions.perform()

    def press(self, key):
        ActionChains(self).send_keys(key).perform()

    def wheel(self, x, y, down):
        """Turn the wheel at a place of the window."""
        place = ScrollOrigin.from_viewport(x, y)
        ActionChains(self, duration=0).scroll_from_origin(place, 0, down).perform()


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
    browser.get_log("browser")
    browser.get(report.as_uri())
    browser.run(SEEN)
    return browser


def test_nothing_is_fetched_and_every_figure_is_shown(page):
    assert page.run(ELSEWHERE) == []
    assert page.get_log("browser") == []
    widths = page.run("return [...document.images].map((image) => image.naturalWidth)")
    assert len(widths) == 5
    assert min(widths) > 300


def test_the_view_has_colours_turns_when_dragged_and_is_cut_open(page):
    x, y = page.run(MIDDLE)
    before, colours = page.run(SEEN), page.run(COLOURS)
    assert sum(count > 50 for count in colours.values()) > 20
    page.drag((x, y, 120, 40))
    assert page.run(SEEN) != before
    # back to where it was
    page.drag((x + 120, y + 40, -120, -40))
    assert page.run(SEEN) == before
    # but for advice on how this test reads pixels
    assert [one for one in page.get_log("browser") if "getImageData" not in one["message"]] == []
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
    WebDriverWait(page, 5, 0.02).until(lambda one: one.run("return scrollY") > top)
    assert page.run(SEEN) == before
    x, y = page.run(MIDDLE)
    page.drag((x, y, 0, 0))
    top = page.run("return scrollY")
    page.wheel(x, y, -120)
    assert page.run(SEEN) != before
    assert page.run("return scrollY") == top


def test_keys_turn_and_zoom_and_r_and_the_button_reset(page):
    before = page.run(SEEN)
    for key in ("+", "-", "\ue012", "\ue013"):
        page.run("document.querySelector('canvas.view').focus()")
        page.press(key)
        assert page.run(SEEN) != before
        page.press("r")
        assert page.run(SEEN) == before
    page.run("document.querySelector('canvas.view').focus()")
    page.press("+")
    assert page.run(SEEN) != before
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


@pytest.fixture
def phone(browser, report):
    """The screen of a phone."""
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", PHONE)
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    browser.get(report.as_uri())
    yield browser
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_phone_shows_results_without_scrolling_sideways_and_letters_in_their_size(phone):
    assert phone.run(RIGHT) <= phone.run("return document.documentElement.scrollWidth") == 390
    wrong = "one.width != one.getAttribute('width')"
    assert phone.run(f"return [...document.images].filter((one) => {wrong})") == []


def test_one_finger_scrolls_and_two_turn_and_pinch(phone):
    x, y = phone.run(MIDDLE)
    before, top = phone.run(SEEN), phone.run("return scrollY")
    phone.drag((x - 60, y + 60, 0, -120), kind="touch")
    WebDriverWait(phone, 5, 0.02).until(lambda one: one.run("return scrollY") > top)
    assert phone.run(SEEN) == before
    x, y = phone.run(MIDDLE)
    top = phone.run("return scrollY")
    phone.drag((x - 60, y - 40, 40, 30), (x + 40, y + 30, 40, 30), kind="touch")
    assert phone.run("return scrollY") == top
    turned = phone.run(SEEN)
    assert turned != before
    phone.drag((x - 30, y - 20, -40, -30), (x + 30, y + 20, 40, 30), kind="touch")
    assert phone.run(SEEN) not in (before, turned)

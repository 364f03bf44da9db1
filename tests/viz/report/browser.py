"""A real browser for tests: Chromium, which Selenium steers by its driver."""

import json
import shutil
from typing import Any

from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains, ScrollOrigin
from selenium.webdriver.common.actions.action_builder import ActionBuilder
from selenium.webdriver.common.actions.pointer_actions import PointerActions

FLAGS = (
    "headless=new", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run", "disable-sync",
    "disable-background-networking", "disable-component-update", "disable-dev-shm-usage",
    "window-size=1200,1000",
)  # fmt: skip
PHONE = {"deviceMetrics": {"width": 390, "height": 844, "pixelRatio": 2, "touch": True}}


def missing() -> str:
    """What is missing for a browser; empty if nothing is."""
    wanted = {"chromium": ("chromium", "chromium-browser"), "chromium-driver": ("chromedriver",)}
    lacking = [name for name, programs in wanted.items() if not any(map(shutil.which, programs))]
    return f"install {' and '.join(lacking)}" if lacking else ""


class Browser(webdriver.Chrome):
    """One window, or the screen of a phone; use it in a with block."""

    def __init__(self, phone: bool = False) -> None:
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium") or shutil.which("chromium-browser")
        for flag in FLAGS:
            options.add_argument(f"--{flag}")
        if phone:
            options.add_experimental_option("mobileEmulation", PHONE)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        super().__init__(options, webdriver.ChromeService(shutil.which("chromedriver")))

    def run(self, script: str) -> Any:
        """What a script returns, or what its promise holds in the end."""
        return self.execute_script(script)

    def requests(self) -> list[str]:
        """The addresses that the page has asked for since the last call."""
        messages = [json.loads(one["message"])["message"] for one in self.get_log("performance")]
        sent = [x for x in messages if x["method"] == "Network.requestWillBeSent"]
        return [message["params"]["request"]["url"] for message in sent]

    def drag(self, *moves: tuple[int, int, int, int], kind: str = "mouse") -> None:
        """Press at each place of the window, by fingers if the kind is touch, move, and let go."""
        actions = ActionBuilder(self)
        for number, (x, y, dx, dy) in enumerate(moves):
            pointer = PointerActions(actions.add_pointer_input(kind, f"{kind} {number}"))
            pointer.move_to_location(x, y).pointer_down()
            pointer.move_to_location(x + dx, y + dy).pointer_up()
        actions.perform()

    def wheel(self, x: int, y: int, down: int) -> None:
        """Turn the wheel at a place of the window."""
        place = ScrollOrigin.from_viewport(x, y)
        ActionChains(self, duration=0).scroll_from_origin(place, 0, down).perform()

    def press(self, key: str) -> None:
        """Press a key of the keyboard."""
        ActionChains(self).send_keys(key).perform()

"""A real browser for tests: Chromium by its driver, asked over HTTP with nothing but urllib."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import tempfile
import urllib.request
from typing import Any

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


class Browser:
    """One window, or the screen of a phone; use it in a with block."""

    def __init__(self, phone: bool = False) -> None:
        self._emulated = {"mobileEmulation": PHONE} if phone else {}

    def __enter__(self) -> Browser:
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE)
        # once it listens it says where
        said = (re.search(rb"successfully on port (\d+)", line) for line in self._driver.stdout)
        self._url = f"http://127.0.0.1:{int(next(filter(None, said))[1])}"
        flags = [f"--{flag}" for flag in (*FLAGS, f"user-data-dir={self._profile.name}")]
        binary = shutil.which("chromium") or shutil.which("chromium-browser")
        wanted = {
            "goog:chromeOptions": {"binary": binary, "args": flags, **self._emulated},
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
        }
        answer = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self._url += f"/session/{answer['sessionId']}"
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._ask("DELETE", "")
        finally:
            self._driver.terminate()
            self._driver.communicate(timeout=60)
            self._profile.cleanup()

    def _ask(self, method: str, path: str, body: dict[str, Any] | None = None) -> Any:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self._url + path, data=data, method=method)
        request.add_header("Content-Type", "application/json")
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def open(self, url: str) -> None:
        """Load a page."""
        self._ask("POST", "/url", {"url": url})

    def run(self, script: str) -> Any:
        """What a script returns."""
        return self._ask("POST", "/execute/sync", {"script": script, "args": []})

    def log(self, kind: str) -> list[dict[str, Any]]:
        """New lines of the log of the ``browser`` (its console) or its ``performance``."""
        found: list[dict[str, Any]] = self._ask("POST", "/se/log", {"type": kind})
        return found

    def requests(self) -> list[str]:
        """The addresses that the page has asked for since the last call."""
        messages = [json.loads(entry["message"])["message"] for entry in self.log("performance")]
        sent = [x for x in messages if x["method"] == "Network.requestWillBeSent"]
        return [message["params"]["request"]["url"] for message in sent]

    def touch(self, *fingers: tuple[int, int, int, int]) -> None:
        """Fingers press at places of the window, move by so much, and let go."""
        touch = {"type": "pointer", "parameters": {"pointerType": "touch"}}
        moves = [_moves(*one) for one in fingers]
        self._act(
            *({**touch, "id": f"finger {k}", "actions": move} for k, move in enumerate(moves))
        )
        self._ask("DELETE", "/actions")

    def drag(self, x: int, y: int, dx: int, dy: int) -> None:
        """Press at a place of the window, move, and let go."""
        mouse = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}}
        self._act({**mouse, "actions": _moves(x, y, dx, dy)})

    def wheel(self, x: int, y: int, down: int) -> None:
        """Turn the wheel at a place of the window."""
        turn = {"type": "scroll", "x": x, "y": y, "deltaX": 0, "deltaY": down, "duration": 0}
        self._act({"type": "wheel", "id": "w", "actions": [turn]})

    def press(self, key: str) -> None:
        """Press a key of the keyboard."""
        presses = [{"type": kind, "value": key} for kind in ("keyDown", "keyUp")]
        self._act({"type": "key", "id": "k", "actions": presses})

    def _act(self, *actions: dict[str, Any]) -> None:
        self._ask("POST", "/actions", {"actions": list(actions)})


def _moves(x: int, y: int, dx: int, dy: int) -> list[dict[str, Any]]:
    """What a mouse or a finger does to drag something."""
    return [
        {"type": "pointerMove", "duration": 0, "x": x, "y": y},
        {"type": "pointerDown", "button": 0},
        {"type": "pointerMove", "duration": 200, "x": x + dx, "y": y + dy},
        {"type": "pointerUp", "button": 0},
    ]

"""Headless Chromium driven through its own protocol over two pipes: what a person sees, presses and reads, and nothing else."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pytest

_LIMIT_S: Final = 60.0
"""For one answer of a browser on a machine that does much else."""


def chromium() -> str:
    """The browser; without one the test is skipped, or fails where all must be there."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return found
    if os.environ.get("REQUIRE_ALL") == "1":
        pytest.fail("chromium is missing, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
    pytest.skip("chromium is missing")


class Browser:
    """One page in one window. ``width`` and ``height`` in CSS pixels; a phone has touch and two device pixels to each."""

    def __init__(self, profile: Path, width: int, height: int, *, phone: bool) -> None:
        down_read, self._out = os.pipe()
        self._in, up_write = os.pipe()
        for fd in (down_read, up_write):
            os.set_inheritable(fd, True)
        words = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe", "--no-first-run"]
        words += ["--disable-background-networking", "--disable-component-update", f"--user-data-dir={profile}"]
        shell = f'exec "$0" "$@" 3<&{down_read} 4>&{up_write}'
        self._process = subprocess.Popen(
            ["bash", "-c", shell, chromium(), *words, "about:blank"],
            pass_fds=(down_read, up_write),
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        os.close(down_read)
        os.close(up_write)
        self._buffer = b""
        self._number = 0
        self.events: list[dict[str, Any]] = []
        self._session: str | None = None
        targets = self.call("Target.getTargets")["targetInfos"]
        target = next(each["targetId"] for each in targets if each["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Accessibility", "DOM"):
            self.call(f"{domain}.enable")
        self.resize(width, height, phone=phone)

    def resize(self, width: int, height: int, *, phone: bool) -> None:
        """Give the window another size."""
        scale = 2 if phone else 1
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=phone
        )

    def close(self) -> None:
        """End the browser."""
        self._process.terminate()
        self._process.wait(20)
        os.close(self._out)
        os.close(self._in)

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Ask the browser, and return its answer."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        limit_s = time.monotonic() + _LIMIT_S
        while True:
            for found in self._read(limit_s):
                if found.get("id") == self._number:
                    assert "error" not in found, found["error"]
                    result: dict[str, Any] = found["result"]
                    return result

    def _read(self, limit_s: float) -> list[dict[str, Any]]:
        wait_s = limit_s - time.monotonic()
        assert wait_s > 0, "the browser does not answer"
        if select.select([self._in], [], [], wait_s)[0]:
            self._buffer += os.read(self._in, 1 << 20)
        *whole, self._buffer = self._buffer.split(b"\0")
        messages = [json.loads(each) for each in whole]
        self.events += [each for each in messages if "method" in each]
        return messages

    def open(self, url: str) -> None:
        """Go to a page."""
        self.call("Page.navigate", url=url)
        self.until(lambda: self.run("document.readyState") == "complete")

    def run(self, script: str) -> Any:
        """The value of a JavaScript expression."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def text(self, name: str) -> str:
        """What is to be read in the element of an id; "" where it is not shown."""
        return str(self.run(f"(e => e && e.checkVisibility() ? e.innerText : '')(document.getElementById({name!r}))"))

    def until(self, holds: Callable[[], object], limit_s: float = 60.0) -> None:
        """Wait until something is so."""
        end_s = time.monotonic() + limit_s
        while not holds():
            assert time.monotonic() < end_s, "it did not come to be"
            time.sleep(0.05)

    def middle(self, name: str) -> tuple[float, float]:
        """The middle of an element on the screen, scrolled to where it is seen."""
        place = f"document.getElementById({name!r})"
        x, y = self.run(
            f"(e => {{e.scrollIntoView({{block:'center'}}); const r = e.getBoundingClientRect();"
            f" return [r.x + r.width / 2, r.y + r.height / 2]}})({place})"
        )
        return float(x), float(y)

    def press(self, name: str) -> None:
        """Press an element with the mouse, where it is seen: what lies over it gets the press."""
        x, y = self.middle(name)
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def drag(self, name: str, share: float) -> None:
        """Drag from an element's left end over a share of its width."""
        x, y = self.middle(name)
        width = float(self.run(f"document.getElementById({name!r}).getBoundingClientRect().width"))
        begin = x - width / 2 + 20
        self.call("Input.dispatchMouseEvent", type="mousePressed", x=begin, y=y, button="left", clickCount=1)
        for step in range(1, 11):
            at = begin + (width - 24) * share * step / 10
            self.call("Input.dispatchMouseEvent", type="mouseMoved", x=at, y=y, button="left")
        self.call("Input.dispatchMouseEvent", type="mouseReleased", x=at, y=y, button="left", clickCount=1)

    def tap(self, name: str, share: float, *, scroll_px: float = 0.0) -> None:
        """Touch an element at a share of its width from the left, and let go there or so far above."""
        x, y = self.middle(name)
        width = float(self.run(f"document.getElementById({name!r}).getBoundingClientRect().width"))
        here = {"x": x + (share - 0.5) * width, "y": y}
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[here])
        for step in range(1, 11) if scroll_px else ():
            there = {"x": here["x"], "y": y - scroll_px * step / 10}
            self.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[there])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def key(self, name: str, code: int = 0, text: str = "") -> None:
        """Press a key."""
        more = {"text": text} if text else {}
        self.call(
            "Input.dispatchKeyEvent",
            type="keyDown" if text else "rawKeyDown",
            key=name,
            windowsVirtualKeyCode=code,
            **more,
        )
        self.call("Input.dispatchKeyEvent", type="keyUp", key=name, windowsVirtualKeyCode=code)

    def hold_key(self, name: str, code: int, repeats: int) -> None:
        """Hold a key down until it has repeated itself so often."""
        for repeat in range(repeats + 1):
            self.call(
                "Input.dispatchKeyEvent",
                type="rawKeyDown",
                key=name,
                windowsVirtualKeyCode=code,
                autoRepeat=repeat > 0,
            )
        self.call("Input.dispatchKeyEvent", type="keyUp", key=name, windowsVirtualKeyCode=code)

    def type(self, words: str) -> None:
        """Type words where the focus is."""
        self.call("Input.insertText", text=words)

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Write what is seen as a PNG."""
        data = self.call("Page.captureScreenshot", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))

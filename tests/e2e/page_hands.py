"""What the tests of the page share: a boat and her page, windows to look at it, and what a person does there."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.browser import Browser
from tests.e2e.page_process import WORDS

CONTRAST = """(() => {
  const channel = v => { v /= 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; };
  const light = c => 0.2126 * channel(c[0]) + 0.7152 * channel(c[1]) + 0.0722 * channel(c[2]);
  const parse = text => (text.match(/[\\d.]+/g) || []).map(Number);
  const behind = e => {
    for (; e; e = e.parentElement) {
      const c = parse(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] > 0.99) return c;
    }
    return [255, 255, 255];
  };
  const poor = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const e = walk.currentNode.parentElement;
    if (!walk.currentNode.data.trim() || !e.checkVisibility() || ['SCRIPT', 'STYLE'].includes(e.tagName)) continue;
    const under = e.tagName === 'LABEL' && e.control && e.control.type === 'range' ? e.control : e;
    const [a, b] = [light(parse(getComputedStyle(e).color)), light(behind(under))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) poor.push([e.id || e.tagName, walk.currentNode.data, ratio]);
  }
  return poor;
})()"""
SERVED = """
window.streams = [];
const Served = window.EventSource;
window.EventSource = function (...asked) { const stream = new Served(...asked); window.streams.push(stream); return stream; };
"""
"""The page's stream, to put in what a vessel would send."""
CUT = """
window.ahead_ms = 0; window.t_s = 0;
const steady = performance.now.bind(performance);
performance.now = () => steady() + ahead_ms;
streams.at(-1).addEventListener("message", (event) => { window.t_s = JSON.parse(event.data).t_s ?? t_s; });
window.cut = () => {
  streams.at(-1).close();
  window.EventSource = function () { const stream = { close() {} }; streams.push(stream); return stream; };
};
undefined
"""
"""A clock that can be set ahead, and from ``cut`` on no picture but those that are put in."""


def live(browser: Browser, url: str) -> None:
    browser.open(url)
    browser.until(lambda: browser.text("live") == "live" and browser.text("mode") in ("Auto", "Hold"))


def use_key(browser: Browser, words: str = WORDS) -> None:
    browser.run("document.getElementById('key').focus()")
    browser.type(words)
    browser.key("Enter", 13, "\r")
    browser.until(lambda: browser.text("said").startswith("Key:") and "sent" not in browser.text("said"))


def obeyed(phone: Browser, order: str, give: Callable[[], None]) -> None:
    """Give an order as a person does on a slow computer: again, where the page says that it was not heard."""
    for _ in range(5):
        give()
        phone.until(
            lambda: phone.text("said").startswith(f"{order}: obeyed at ") or "NOT HEARD" in phone.text("said"), 20.0
        )
        if "NOT HEARD" not in phone.text("said"):
            return
    pytest.fail(f"{order}: not heard five times")

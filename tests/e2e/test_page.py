"""The page in headless Chromium on a phone's and a desk's window, as a person sees it, and strangers at its door meanwhile."""

from __future__ import annotations

import hashlib
import hmac
import json
import os
import random
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from companion.web.page import read_file
from tests.browser import Browser, chromium
from tests.e2e.page_process import WORDS, Boat, SlowLink
from tests.e2e.sim import BIN, REPO

SIZES = {"phone": (390, 844, True), "desk": (1280, 900, False)}


@pytest.fixture(scope="module")
def boat(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Boat]:
    chromium()
    found = Boat(tmp_path_factory.mktemp("page"), 61)
    yield found
    found.close()


@pytest.fixture(params=SIZES)
def browser(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Browser]:
    width, height, phone = SIZES[request.param]
    found = Browser(tmp_path / "profile", width, height, phone=phone)
    yield found
    found.close()


@pytest.fixture
def phone(tmp_path: Path) -> Iterator[Browser]:
    found = Browser(tmp_path / "profile", *SIZES["phone"][:2], phone=True)
    yield found
    found.close()


def live(browser: Browser, url: str) -> None:
    browser.open(url)
    browser.until(lambda: browser.text("live") == "live" and browser.text("mode") in ("Auto", "Hold"))


def use_key(browser: Browser, words: str = WORDS) -> None:
    browser.run("document.getElementById('key').focus()")
    browser.type(words)
    browser.key("Enter", 13, "\r")
    browser.until(lambda: browser.text("said").startswith("Key:") and "sent" not in browser.text("said"))


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
OVER = """[...document.querySelectorAll('body *')].filter(e => { const r = e.getBoundingClientRect();
  return e.checkVisibility() && !e.classList.contains('sr') && r.width &&
    (r.right > innerWidth + 1 || r.left < -1); }).map(e => e.id || e.tagName)"""
SMALL = """[...document.querySelectorAll('button, input, summary')].filter(e => e.checkVisibility() && !e.classList.contains('plain') &&
  e.getBoundingClientRect().height < 44).map(e => e.id)"""


def test_the_first_view_is_small_own_readable_and_named(boat: Boat, browser: Browser) -> None:
    live(browser, boat.url)
    browser.until(lambda: "under the keel" in browser.text("figures").lower())
    asked = [e["params"]["request"]["url"] for e in browser.events if e["method"] == "Network.requestWillBeSent"]
    assert {urlsplit(url).netloc for url in asked if not url.startswith("data:")} == {f"127.0.0.1:{boat.port}"}
    loaded = [e["params"]["encodedDataLength"] for e in browser.events if e["method"] == "Network.loadingFinished"]
    received = [e["params"]["encodedDataLength"] for e in browser.events if e["method"] == "Network.dataReceived"]
    print(f"first view: {len(asked)} requests, {sum(loaded)} bytes, stream so far {sum(received)} bytes")
    assert sum(loaded) + sum(received) < 150_000
    assert browser.run("document.documentElement.scrollWidth <= innerWidth")
    assert browser.run(OVER) == []
    assert browser.run(CONTRAST) == []
    assert browser.run(SMALL) == []
    nodes = browser.call("Accessibility.getFullAXTree")["nodes"]
    touched = [n for n in nodes if n.get("role", {}).get("value") in ("button", "textbox", "slider", "image", "link")]
    assert len(touched) >= 6
    assert [n for n in touched if not n.get("ignored") and not n.get("name", {}).get("value")] == []


BARE = """(() => { const body = document.body, bar = document.getElementById('orders');
  body.classList.remove('orders', 'keyed'); const bare = bar.offsetHeight;
  body.classList.add('orders'); return [bare, bar.offsetHeight]; })()"""


def test_a_boat_that_takes_no_orders_has_no_empty_bar_over_the_foot_of_the_page(boat: Boat, browser: Browser) -> None:
    live(browser, boat.url)
    bare, offered = browser.run(BARE)
    assert bare == 0
    assert offered > 40


def test_every_state_is_said_in_words(boat: Boat, browser: Browser) -> None:
    live(browser, boat.url)
    assert browser.text("armed") in ("ARMED", "disarmed")
    assert browser.text("now")
    assert "m" in browser.text("keel")
    assert "home" in browser.text("where")
    name = browser.run("document.getElementById('map').getAttribute('aria-label')")
    assert "heading" in name
    assert "armed" in browser.text("texts")
    assert "compass" in browser.text("links")


def test_it_is_worked_by_the_keyboard_alone(boat: Boat, phone: Browser) -> None:
    live(phone, boat.url)
    reached = []
    for _ in range(12):
        phone.key("Tab", 9)
        reached.append(phone.run("document.activeElement.id || document.activeElement.tagName"))
        ring = phone.run("getComputedStyle(document.activeElement).outlineStyle")
        assert reached[-1] == "BODY" or ring != "none"
    assert {"key", "map", "closer", "all"} <= set(reached)


def test_it_is_new_each_second_and_says_when_it_is_old(boat: Boat, phone: Browser) -> None:
    """Counted over ten seconds, which a busy machine may stretch; then the vessel's process hangs."""
    live(phone, boat.url)
    phone.run(
        "window.seen = []; new MutationObserver(() => seen.push(1)).observe("
        "document.getElementById('figures'), {subtree: true, childList: true, characterData: true})"
    )
    time.sleep(10.0)
    assert phone.run("seen.length") >= 10
    boat.freeze()
    try:
        phone.until(lambda: phone.text("live").startswith("OLD: "), 30.0)
        assert phone.run("document.body.classList.contains('old')")
        assert phone.run(CONTRAST) == [], "greyed, and readable all the same"
    finally:
        boat.thaw()
    phone.until(lambda: phone.text("live") == "live", 30.0)


LATE_ONCE = """
let late = false, waits = true;
const soon = window.fetch;
window.fetch = async (...asked) => {
  const found = await soon(...asked);
  if (asked[0] === "/order" && waits) {
    waits = false;
    await new Promise((go) => setTimeout(go, 3000));
    setTimeout(() => { late = true; }, 500);
  }
  return found;
};
undefined
"""
"""The first order's answer comes 3 s late."""


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


def test_hold_and_disarm_with_the_key_only_and_not_heard_is_said(boat: Boat, phone: Browser) -> None:
    live(phone, boat.url)
    assert phone.text("hold") == ""
    use_key(phone, "a wrong key, surely")
    assert phone.text("said") == "Key: refused: wrong key"
    assert not phone.run(KEYED), "a wrong key is forgotten"
    use_key(phone)
    assert "right" in phone.text("said")
    obeyed(phone, "Hold", lambda: phone.press("hold"))
    phone.until(lambda: phone.text("mode") == "Hold")
    for give in (
        lambda: phone.drag("disarm", 0.6),
        lambda: phone.tap("disarm", 0.95),
        lambda: phone.tap("disarm", 0.95, scroll_px=200.0),
        lambda: phone.run("document.getElementById('disarm').focus()") or phone.key("End", 35),
        lambda: phone.press("disarm"),
    ):
        give()
        time.sleep(1.0)
        assert phone.text("armed") == "ARMED"
    assert phone.run("document.getElementById('disarm').value") == "0"
    assert phone.text("said") == "Disarm: slide the red block to the end; by keys or a screen reader step by step"
    phone.run(LATE_ONCE)
    phone.press("hold")
    obeyed(phone, "Disarm", lambda: phone.drag("disarm", 1.0))
    phone.until(lambda: phone.text("armed") == "disarmed")
    phone.until(lambda: phone.run("late"), 20.0)
    assert phone.text("said").startswith("Disarm: obeyed at "), "what an earlier order came to hides it"
    # last, for a vessel whose computer stood still disarms itself
    boat.freeze()
    try:
        phone.press("hold")
        phone.until(lambda: "NOT HEARD: use the emergency switch" in phone.text("said"), 10.0)
    finally:
        boat.thaw()
    phone.until(lambda: phone.text("live") == "live", 30.0)
    assert phone.run(CONTRAST) == []
    secret = hashlib.pbkdf2_hmac("sha256", WORDS.encode(), b"usv-companion page", 100_000, 32).hex()
    sent = [json.dumps(e["params"]["request"]) for e in phone.events if e["method"] == "Network.requestWillBeSent"]
    assert len(sent) > 8
    assert not [each for each in sent if secret in each or WORDS in each]
    told = {("set mode mode hold", "127.0.0.1", "page key"), ("disarm", "127.0.0.1", "page key")}
    phone.until(lambda: orders_by_the_page(boat) == told, 20.0)  # the file is written once a second


KEYED = "document.body.classList.contains('keyed')"
CHECKS_KEPT = """
window.checks = []; window.checked = 0;
const soon = window.fetch;
window.fetch = async (path, given) => {
  if (path !== "/order" || JSON.parse(given.body).order !== "check") return soon(path, given);
  await new Promise((go) => checks.push(go));
  const found = await soon(path, given);
  setTimeout(() => { checked += 1; }, 300);
  return found;
};
undefined
"""
"""Tries of a key are on their way until they are let go."""


def test_a_key_is_forgotten_for_being_wrong_only_and_its_check_hides_no_order(boat: Boat, phone: Browser) -> None:
    live(phone, boat.url)
    phone.run(CHECKS_KEPT)
    for number, words in enumerate(("a wrong key, surely", WORDS), start=1):
        phone.run("document.getElementById('key').focus()")
        phone.type(words)
        phone.key("Enter", 13, "\r")
        phone.until(lambda number=number: phone.run("checks.length") == number)
        if number == 1:
            phone.run("document.getElementById('forget').click(); 1")
    obeyed(phone, "Hold", lambda: phone.press("hold"))
    phone.run("for (const go of checks) go()")
    phone.until(lambda: phone.run("checked") == 2)
    assert phone.run(KEYED), "neither by another key's check, nor by one that an order went past"
    assert phone.text("said").startswith("Hold: obeyed at ")


KEPT = """
window.kept = []; window.ordered = []; window.asleep_ms = 0; window.later_s = 0;
const soon = window.fetch, wall = Date.now;
Date.now = () => wall() + asleep_ms;
window.fetch = (path, given) => {
  if (path === "/order") ordered.push(JSON.parse(given.body).order);
  if (path !== "/challenge") return soon(path, given);
  const later = async () => {
    const found = await (await soon(path, given)).json();
    if (found.challenge) found.challenge.t_s += later_s;
    return new Response(JSON.stringify(found));
  };
  return new Promise((go) => kept.push(() => go(later())));
};
window.back = () => { for (const go of kept.splice(0)) go(); };
undefined
"""
"""No way to the boat: questions are kept until ``back``, as a browser does. The wall clock, and the boat's, can be set ahead."""
OUT_OF_SIGHT = "document.dispatchEvent(new Event('visibilitychange'))"


@pytest.mark.parametrize("sleeps", [OUT_OF_SIGHT, "later_s = 60"], ids=["out of sight", "a lid that was shut"])
def test_an_order_that_was_not_heard_or_has_another_after_it_is_given_up(
    sleeps: str, boat: Boat, phone: Browser
) -> None:
    live(phone, boat.url)
    use_key(phone)
    phone.run(KEPT)
    phone.press("hold")
    phone.until(lambda: "NOT HEARD" in phone.text("said"))
    phone.run("back()")
    phone.press("hold")
    phone.run(f"asleep_ms = 60000; {sleeps}; back()")  # the telephone slept, and with it its timers
    time.sleep(1.0)
    assert phone.run("ordered") == []
    for _ in range(2):
        phone.drag("disarm", 1.0)
    for _ in range(2):
        phone.run("document.getElementById('hold').click()")
    phone.run("back()")
    phone.until(lambda: phone.text("said").startswith("Hold: obeyed at "))
    assert set(phone.run("ordered")) == {"hold"}


def test_a_clock_that_is_set_right_drops_no_order(boat: Boat, phone: Browser) -> None:
    """Between the press and the challenge, while a person looks on: the wall clock leaps, and nothing slept."""
    live(phone, boat.url)
    use_key(phone)
    phone.run(KEPT)
    for leap_ms in (5000, -5000):
        press = f"document.getElementById('hold').click(); asleep_ms += {leap_ms}; back()"
        obeyed(phone, "Hold", lambda press=press: phone.run(press))
    assert set(phone.run("ordered")) == {"hold"}


def test_what_an_order_came_to_is_green_only_while_it_is_so(boat: Boat, phone: Browser) -> None:
    """After each a station starts the plan again."""
    start = [BIN / "companion", "plan", "start", "--url", f"tcpout://127.0.0.1:{boat.sim.port(5760)}"]
    live(phone, boat.url)
    use_key(phone)
    for order, give, is_so in (
        ("Hold", lambda: phone.press("hold"), lambda: phone.text("mode") == "Hold"),
        ("Disarm", lambda: phone.drag("disarm", 1.0), lambda: phone.text("armed") == "disarmed"),
    ):
        obeyed(phone, order, give)
        phone.until(is_so)
        time.sleep(5.0)
        assert "then" not in phone.text("said")
        subprocess.run(start, check=True, capture_output=True, cwd=REPO, timeout=60)
        phone.until(lambda: phone.text("said").endswith("; then ARMED, Auto"))
        assert phone.text("said").startswith(f"{order}: obeyed at ")
        assert phone.run("document.getElementById('said').className") == "past"


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
NARROW = """(() => {
  const lines = e => { const r = document.createRange(); r.selectNodeContents(e); return r.getClientRects(); };
  const label = [...lines(document.querySelector('.slide label'))], slide = document.getElementById('disarm').getBoundingClientRect();
  return {bar: document.getElementById('orders').getBoundingClientRect().toJSON(),
    failsafes: document.getElementById('failsafes').getBoundingClientRect().bottom,
    inside: label.every(r => r.top >= slide.top && r.bottom <= slide.bottom && r.right <= slide.right),
    broken: ['xte', 'togo', 'fence'].filter(id => lines(document.getElementById(id)).length !== 1),
    wide: document.documentElement.scrollWidth - innerWidth};
})()"""
IN_TROUBLE = {
    "armed": True,
    "next": ["RETURNS in 48 s unless ground station is back"],
    "failsafes": [{"name": "gcs", "cause": "Ground station lost", "doing": "HOLD", "next_in_s": None, "until": ""}],
    "cross_track_m": -154.7,
    "to_go_m": 24_980.0,
    "fence_on": True,
    "fence_m": 1234.5,
}


@pytest.mark.parametrize(("width", "height", "share"), [(320, 568, 0.36), (360, 740, 0.26), (740, 360, 0.26)])
def test_on_a_small_screen_the_bar_hides_no_failsafe_and_all_words_are_whole(
    width: int, height: int, share: float, boat: Boat, phone: Browser
) -> None:
    phone.resize(width, height, phone=True)
    phone.call("Page.addScriptToEvaluateOnNewDocument", source=SERVED)
    live(phone, boat.url)
    phone.run("document.body.classList.add('orders', 'keyed'); document.getElementById('said').className = 'bad'; 1")
    phone.run("document.getElementById('said').textContent = 'Disarm: NOT HEARD: use the emergency switch'")
    phone.run(f"streams.at(-1).onmessage({{data: {json.dumps(json.dumps(IN_TROUBLE))}}})")
    seen = phone.run(NARROW)
    assert seen["bar"]["height"] < share * height
    assert seen["failsafes"] < seen["bar"]["top"]
    assert seen["inside"]
    assert seen["broken"] == []
    assert seen["wide"] <= 0


def test_a_picture_of_before_the_order_is_no_news_of_it(boat: Boat, phone: Browser) -> None:
    """It was kept back on the way and comes when the answer is long there. Only the vessel's clock tells."""
    phone.call("Page.addScriptToEvaluateOnNewDocument", source=SERVED)
    live(phone, boat.url)
    use_key(phone)
    phone.run(CUT)
    phone.until(lambda: phone.run("t_s > 0"))
    phone.run("cut()")
    before_s = phone.run("t_s")

    def shown(t_s: float, mode: str) -> str:
        picture = json.dumps({"t_s": t_s, "mode": mode, "armed": True})
        phone.run(f"streams.at(-1).onmessage({{data: {json.dumps(picture)}}})")
        return phone.text("said").partition("; then ")[2]

    obeyed(phone, "Hold", lambda: phone.press("hold"))
    phone.run("ahead_ms = 4000; 1")
    assert shown(before_s + 0.1, "Auto") == ""
    assert shown(before_s + 1000.0, "Hold") == ""
    assert shown(before_s + 1001.0, "Auto") == "ARMED, Auto"
    obeyed(phone, "Hold", lambda: phone.press("hold"))
    phone.run("ahead_ms = 8000; 1")
    assert shown(1.0, "Manual") == "ARMED, Manual", "started again: what she did before is gone"


ORDERS_SEEN = """
window.names = [];
const unnamed = window.fetch;
window.fetch = (path, given) => {
  if (path === "/order") names.push(JSON.parse(given.body).page);
  return unnamed(path, given);
};
undefined
"""
"""The names by which the page gives its orders."""
ANSWERED = """
window.answered_s = 0;
const unheard = window.fetch;
window.fetch = async (...asked) => {
  const found = await unheard(...asked);
  const told = (await found.clone().json()).answer;
  if (told) answered_s = told.t_s;
  return found;
};
undefined
"""
"""When, by the vessel's clock, it answered last."""


@pytest.mark.parametrize("pictures", [[0.3], [0.1, 0.3]])
def test_a_hold_is_green_no_more_when_she_is_disarmed_however_soon(
    pictures: list[float], boat: Boat, phone: Browser
) -> None:
    """She drifts in mode Hold: another telephone's Disarm, or one of before that was on its way."""
    phone.call("Page.addScriptToEvaluateOnNewDocument", source=SERVED)
    live(phone, boat.url)
    use_key(phone)
    phone.run(CUT)
    phone.run(ANSWERED)
    phone.run("cut()")
    obeyed(phone, "Hold", lambda: phone.press("hold"))
    for after_s in (-0.1, *pictures):
        last = after_s == pictures[-1]
        picture = json.dumps({"t_s": phone.run("answered_s") + after_s, "mode": "Hold", "armed": not last})
        phone.run(f"streams.at(-1).onmessage({{data: {json.dumps(picture)}}})")
        assert phone.text("said").endswith("; then disarmed, Hold") == last
    assert phone.run("document.getElementById('said').className") == "past"


def test_an_order_from_before_the_page_was_loaded_again_does_not_follow_a_later_one(boat: Boat, phone: Browser) -> None:
    """It is on its way all the same: the tab has one name, however often the page is loaded."""
    live(phone, boat.url)
    use_key(phone)
    names = []
    for _ in range(2):
        live(phone, boat.url)
        phone.run(ORDERS_SEEN)
        obeyed(phone, "Hold", lambda: phone.press("hold"))
        names += phone.run("names")
    assert len(set(names)) == 1
    phone.run("sessionStorage.clear()")
    live(phone, boat.url)
    use_key(phone)
    phone.run(ORDERS_SEEN)
    obeyed(phone, "Hold", lambda: phone.press("hold"))
    assert phone.run("names")[0] not in names, "another tab is another page"


SLEPT = """(() => {
  const wall = Date.now;
  Date.now = () => wall() + 300000;
  document.dispatchEvent(new Event("visibilitychange"));
  return document.getElementById("live").textContent;
})()"""
"""The telephone's clock goes on while it sleeps; what a browser counts by does not."""


def test_a_telephone_that_slept_says_at_once_how_old_its_picture_is(boat: Boat, phone: Browser) -> None:
    live(phone, boat.url)
    assert phone.run(SLEPT).startswith("OLD: 30")
    phone.until(lambda: phone.text("live") == "live")


def test_a_stream_that_went_silent_is_opened_anew_and_what_it_kept_back_is_not_shown(
    boat: Boat, phone: Browser
) -> None:
    phone.call("Page.addScriptToEvaluateOnNewDocument", source=SERVED)
    live(phone, boat.url)
    phone.run(CUT)
    kept = json.dumps({"mode": "of before"})
    phone.run(f"streams.at(-1).close(); ahead_ms = 20000; streams[0].onmessage({{data: {json.dumps(kept)}}})")
    assert phone.text("mode") != "of before"
    phone.until(lambda: phone.run("streams.length") > 1 and phone.text("live") == "live")
    phone.run("cut()")
    opened = phone.run("streams.length")
    for _ in range(3):
        phone.run("ahead_ms += 9000; document.dispatchEvent(new Event('visibilitychange'))")
    assert phone.run("streams.length") - opened == 3, "for as long as the way is gone"
    phone.run("streams.at(-1).onopen(); ahead_ms += 9000; document.dispatchEvent(new Event('visibilitychange'))")
    assert phone.run("streams.length") - opened == 3, "its first picture is under way on a slow link"


SPOKEN = """
window.spoken = [];
for (const e of document.querySelectorAll("[aria-live], [role=status], [role=alert]"))
  new MutationObserver(() => spoken.push([e.id, e.textContent])).observe(e, {subtree: true, childList: true, characterData: true});
undefined
"""
"""What a screen reader says by itself from now on."""


def test_a_screen_reader_is_told_what_changes_and_no_seconds(boat: Boat, phone: Browser) -> None:
    phone.call("Page.addScriptToEvaluateOnNewDocument", source=SERVED)
    live(phone, boat.url)
    phone.run(SPOKEN)
    boat.freeze()
    try:
        phone.until(lambda: phone.text("live").startswith("OLD: "), 30.0)
        seen = phone.text("live")
        phone.until(lambda: phone.text("live") not in (seen, ""), 30.0)
        time.sleep(3.0)
    finally:
        boat.thaw()
    phone.until(lambda: phone.text("live") == "live", 30.0)
    told = phone.run("spoken.filter(([id]) => id !== 'failsafestold').map((each) => each[1])")
    assert len(told) >= 2
    assert set(told) <= {"OLD: the boat is not heard", "NO WORD OF THE BOAT", "live"}
    phone.run("spoken.length = 0")
    lost = {"name": "gcs_lost", "cause": "Ground station lost", "doing": "warning", "next": "RETURN", "runs": True}
    person = {"name": "person", "cause": "Person in the water, 120 m", "doing": "", "next": "", "next_in_s": None}
    for failsafes in (
        [{**lost, "next_in_s": 48, "until": ""}],
        [{**lost, "next_in_s": 47, "until": ""}],
        [{**lost, "next_in_s": None, "doing": "RETURN", "until": ""}],
        [{**lost, "next_in_s": None, "doing": "RETURN", "until": ""}, {**person, "until": ""}],
        [
            {**lost, "next_in_s": None, "doing": "RETURN", "until": ""},
            {**person, "cause": "Person, 110 m", "until": ""},
        ],
        [],
    ):
        phone.run(f"streams.at(-1).onmessage({{data: {json.dumps(json.dumps({'failsafes': failsafes}))}}})")
    assert phone.run("spoken.filter(([id]) => id === 'failsafestold').map((each) => each[1])") == [
        "Failsafe: Ground station lost: warning.",
        "Failsafe: Ground station lost: RETURN.",
        "Failsafe: Ground station lost: RETURN. Failsafe: Person in the water, 120 m: taken over.",
        "No failsafe any more.",
    ]


STEP = """(() => { const slide = document.getElementById('disarm'); slide.stepUp(); for (const kind of ['input', 'change'])
  slide.dispatchEvent(new Event(kind, {bubbles: true})); return slide.value; })()"""
"""What a browser makes of a screen reader's step: no key is pressed."""


def test_disarm_by_keys_and_by_a_screen_readers_steps_and_by_no_single_one(boat: Boat, phone: Browser) -> None:
    phone.open(boat.url)
    phone.run("document.body.classList.add('orders', 'keyed')")  # no key: what is given is asked for, and no more
    phone.run(
        "window.asked = []; const soon = window.fetch; window.fetch = (...all) => (asked.push(all[0]), soon(...all)); 1"
    )
    slide = "document.getElementById('disarm')"

    def given() -> bool:
        return bool(phone.run("asked.splice(0).includes('/challenge')"))

    phone.tap("disarm", 0.95)  # what a finger began hinders no step
    for step, least, most in (
        (lambda: phone.key("ArrowRight", 39), 10, 40),
        (lambda: phone.key("PageUp", 33), 5, 20),
        (lambda: phone.run(STEP), 10, 40),
    ):
        phone.run(f"{slide}.focus()")
        steps = 0
        while steps == 0 or phone.run(f"{slide}.value") != "0":
            assert steps < most
            assert not given(), steps
            step()
            steps += 1
        assert steps >= least
        phone.until(given)
    for key, code in (("End", 35), ("ArrowRight", 39)):
        phone.hold_key(key, code, 60)
        assert int(phone.run(f"{slide}.value")) < 50
        phone.run(f"{slide}.blur()")
        assert phone.run(f"{slide}.value") == "0"
        phone.run(f"{slide}.focus()")
    phone.run(f"{slide}.value = 100; for (const kind of ['input', 'change']) {slide}.dispatchEvent(new Event(kind)); 1")
    assert phone.run(f"{slide}.value") == "0", "a screen reader's leap"
    time.sleep(1.0)
    assert not given()


def orders_by_the_page(boat: Boat) -> set[tuple[str, str, str]]:
    """What the run's events tell: order, host, proof."""
    lines = (boat.sim.run_dir / "events.jsonl").read_text().splitlines()
    events = [json.loads(line) for line in lines if '"page"' in line and line.endswith("}")]
    return {(each["order"], each["host"], each["proof"]) for each in events}


def test_the_hashes_of_the_page_are_the_standards(phone: Browser) -> None:
    """Against the standard library, for every length around the blocks, and RFC 7914's vector of PBKDF2."""
    phone.run(read_file("sha256.js").replace("const Sha", "window.Sha") + ";1")
    chance = random.Random(3)
    for length in [*range(132), 1000]:
        data, key = chance.randbytes(length), chance.randbytes(1 + length)
        found = phone.run(
            f"[Sha.hex(Sha.digest(Sha.unhex('{data.hex()}'))), Sha.hex(Sha.hmac(Sha.unhex('{key.hex()}'), Sha.unhex('{data.hex()}')))]"
        )
        assert found == [hashlib.sha256(data).hexdigest(), hmac.new(key, data, hashlib.sha256).hexdigest()]
    derived = phone.run(
        "new Promise(done => Sha.pbkdf2(new TextEncoder().encode('passwd'), new TextEncoder().encode('salt'), 1, k => done(Sha.hex(k))))"
    )
    assert derived == "55ac046e56e3089fec1691c22544b605f94185216dde0465e68b9d57c20dacbc"


def test_at_a_megabit_the_first_view_is_there_within_two_seconds_of_the_link(boat: Boat, phone: Browser) -> None:
    """What crosses the link until the page is live takes it so long; a busy computer's own time is printed, not judged."""
    link = SlowLink(boat.port, 1_000_000 / 8)
    began_s = time.monotonic()
    live(phone, f"http://127.0.0.1:{link.port}/")
    print(f"1 Mbit/s: first view in {time.monotonic() - began_s:.2f} s with {link.down_bytes} bytes")
    assert link.down_bytes * 8 / 1_000_000 < 2.0
    link.close()


def test_a_link_of_50_kbit_carries_it(boat: Boat, phone: Browser) -> None:
    slow = SlowLink(boat.port, 50_000 / 8)
    began_s = time.monotonic()
    live(phone, f"http://127.0.0.1:{slow.port}/")
    view_s, first = time.monotonic() - began_s, slow.down_bytes
    time.sleep(8.0)  # the map and the rest come meanwhile
    before, began_s = slow.down_bytes, time.monotonic()
    time.sleep(15.0)
    rate = (slow.down_bytes - before) / (time.monotonic() - began_s)
    print(f"50 kbit/s: first view in {view_s:.1f} s with {first} bytes, then {rate:.0f} B/s")
    assert view_s < 30.0
    assert rate < 4000.0
    assert phone.text("live") == "live"
    slow.close()


# ---- strangers


def raw(port: int, data: bytes, wait_s: float = 10.0) -> bytes:
    """Say something, and return all that comes back."""
    with socket.create_connection(("127.0.0.1", port), wait_s) as stream:
        found = b""
        try:
            stream.sendall(data)
            while more := stream.recv(65_536):
                found += more
        except (ConnectionError, TimeoutError):
            pass
        return found


def request(path: str, method: str = "GET", body: bytes = b"", **headers: str) -> bytes:
    lines = {"Host": "127.0.0.1", "Content-Length": str(len(body)), **headers}
    head = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in lines.items())
    return f"{method} {path} HTTP/1.1\r\n{head}\r\n".encode("latin-1") + body


@pytest.mark.parametrize(
    "path",
    [
        "/runs/../../page.key",
        "/runs/..%2f..%2fpage.key",
        "/runs/20260101-120000/companion.db",
        "//etc/passwd",
        "/../page.key",
        "/runs/20260101-120000/../../page.key",
        "/runs/./20260101-120000/../20260101-120000/status.sock",
        "/page.js",
    ],
)
def test_no_path_leads_outside(boat: Boat, path: str) -> None:
    found = raw(boat.port, request(path))
    assert found.split(b" ")[1] in (b"404", b"400")
    assert (boat.folder / "page.key").read_bytes() not in found


def test_runs_are_downloaded_whole(boat: Boat) -> None:
    found = raw(boat.port, request("/runs/20260101-120000/run.json"))
    head, _, body = found.partition(b"\r\n\r\n")
    assert b"attachment" in head
    assert body == (boat.sim.run_dir / "run.json").read_bytes()


def test_strangers_disturb_neither_the_vessel_nor_the_operators_page(boat: Boat, phone: Browser) -> None:
    """200 connections that never ask, others that ask for ever or too much, another site's orders: the operator's are obeyed."""
    live(phone, boat.url)
    use_key(phone)
    slow = []
    for number in range(200):
        stream = socket.create_connection(("127.0.0.1", boat.port), 10.0)
        stream.sendall(
            [b"", b"GET /", b"GET / HTTP/1.1\r\nX: ", b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n"][
                number % 4
            ]
        )
        slow.append(stream)
    ticks = rows(boat)
    phone.press("hold")
    phone.until(lambda: phone.text("said").startswith("Hold: obeyed at "), 20.0)
    assert raw(boat.port, request("/", **{"X": "y" * 100_000})).startswith(b"HTTP/1.1 431")
    body = b'{"order":"disarm","nonce":"","response":""}'
    for headers in (
        {"Origin": "http://evil.example"},
        {},
        {"Origin": "http://127.0.0.1", "Sec_Fetch_Site": "cross-site"},
    ):
        told = raw(boat.port, request("/order", "POST", body, Content_Type="application/json", **headers))
        assert told.startswith(b"HTTP/1.1 403")
    own = {"Origin": "http://127.0.0.1", "Content_Type": "application/json"}
    assert b"refused" in raw(boat.port, request("/order", "POST", body, **own))
    assert raw(boat.port, request("/", Host="evil.example")).startswith(b"HTTP/1.1 421")
    fuzz(boat.port, 300, random.Random(7))
    assert phone.text("live") == "live"
    assert rows(boat) > ticks
    phone.press("hold")
    phone.until(lambda: phone.text("said").startswith("Hold: obeyed at "), 20.0)
    for stream in slow:
        stream.close()
    assert boat.web.poll() is None
    assert "Traceback" not in boat.log.read_text()


def rows(boat: Boat) -> int:
    return (boat.sim.run_dir / "control.csv").stat().st_size


def fuzz(port: int, count: int, chance: random.Random) -> None:
    """Requests made of right ones: cut, mixed, with noise, of every route."""
    routes = ["/", "/live", "/map", "/depths", "/runs", "/runs/20260101-120000/run.json", "/challenge", "/order"]
    for _ in range(count):
        data = bytearray(
            request(
                chance.choice(routes),
                chance.choice(["GET", "POST", "PUT", "G\x00T"]),
                chance.choice([b"", b"{}", b"[1", b'{"order":"hold"}', chance.randbytes(40)]),
                **chance.choice(
                    [{}, {"Origin": "http://127.0.0.1", "Content_Type": "application/json"}, {"Connection": "x"}]
                ),
            )
        )
        for _ in range(chance.randrange(4)):
            place = chance.randrange(len(data))
            data[place : place + chance.randrange(8)] = chance.randbytes(chance.randrange(6))
        with socket.create_connection(("127.0.0.1", port), 10.0) as stream:
            stream.settimeout(0.02)
            try:
                stream.sendall(bytes(data[: chance.randrange(len(data) + 1)] if chance.random() < 0.3 else data))
                stream.recv(512)
            except OSError:
                pass


def test_orders_go_one_after_another_by_one_connection_and_all_else_by_its_own(boat: Boat) -> None:
    """A browser gives the first way to the boat to its oldest question: the order behind it waits for no other way."""
    own = {"Origin": "http://127.0.0.1", "Content_Type": "application/json"}
    ask = request("/challenge", "POST", b"{}", **own)
    assert raw(boat.port, ask * 3).count(b'{"challenge":') == 3
    assert raw(boat.port, request("/challenge", "POST", b"{}", Connection="close", **own) * 2).count(b"HTTP/1.1") == 1
    assert raw(boat.port, request("/runs") * 2).count(b"HTTP/1.1") == 1
    assert raw(boat.port, ask + request("/order", "POST", b"{}", Origin="http://evil.example")).endswith(b"page only\n")


@pytest.mark.soak
def test_a_hundred_thousand_fuzzed_requests_change_nothing(boat: Boat, phone: Browser) -> None:
    live(phone, boat.url)
    orders = (boat.sim.run_dir / "events.jsonl").read_text().count('"page"')
    fuzz(boat.port, int(os.environ.get("PAGE_FUZZ", "100000")), random.Random(11))
    assert phone.text("live") == "live"
    assert boat.web.poll() is None
    assert "Traceback" not in boat.log.read_text()
    assert (boat.sim.run_dir / "events.jsonl").read_text().count('"page"') == orders

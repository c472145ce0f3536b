"""The page in headless Chromium on a phone's and a desk's window, as a person sees it."""

from __future__ import annotations

import hashlib
import hmac
import json
import random
import time
from urllib.parse import urlsplit

import pytest

from companion.web.page import read_file
from tests.browser import Browser
from tests.e2e.page_hands import CONTRAST, CUT, SERVED, live
from tests.e2e.page_process import Boat, SlowLink

INSTANCE = 61
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
    person = {
        "name": "person",
        "cause": "Person in the water, 120 m",
        "doing": "taken over",
        "next": "",
        "next_in_s": None,
    }
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

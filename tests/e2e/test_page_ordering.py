"""Orders given on the page in headless Chromium: obeyed, refused or not heard, and what the page says of each."""

from __future__ import annotations

import hashlib
import json
import subprocess
import time

import pytest

from tests.browser import Browser
from tests.e2e.page_hands import CONTRAST, CUT, SERVED, live, obeyed, use_key
from tests.e2e.page_process import WORDS, Boat
from tests.e2e.sim import BIN, REPO

INSTANCE = 62
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


def orders_by_the_page(boat: Boat) -> set[tuple[str, str, str]]:
    """What the run's events tell: order, host, proof."""
    lines = (boat.sim.run_dir / "events.jsonl").read_text().splitlines()
    events = [json.loads(line) for line in lines if '"page"' in line and line.endswith("}")]
    return {(each["order"], each["host"], each["proof"]) for each in events}


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

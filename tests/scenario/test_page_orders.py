"""Hold and Disarm of the page on the simulated vessel: obeyed with the key and once, refused without, and no station's sign of life."""

from __future__ import annotations

import hashlib
import hmac
import json
import math
import os
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from companion.io.local_socket import LocalServer
from companion.status.client import Client
from companion.status.orders import LIFE_US, Challenges, HeardOrder, PageOrder, RefusedOrder
from companion.status.service import StatusService
from mavlink_bridge.language.messages import Action, Mode
from tests.scenario.test_station_lost import AUTO, SET_MODE, under_way
from tests.world_station import Helm

KEY = bytes(range(32))
VESSEL = "5a" * 16
LATER = "a later order came first: press again"


def answer_to(challenge: dict[str, str], order: str, key: bytes = KEY, page: str = "") -> str:
    """The page's response, as docs/PAGE.md words it."""
    text = f"usv-companion page order 2\n{challenge['vessel']}\n{challenge['nonce']}\n{order}\n{page}"
    return hmac.new(key, text.encode(), hashlib.sha256).hexdigest()


PAGES: list[Page] = []


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    while PAGES:
        page = PAGES.pop()
        page.client.close()
        page.service.close()


class Page:
    """A watcher of a helm's vessel that may order."""

    def __init__(self, helm: Helm, tmp_path: Path, key: bytes | None = KEY) -> None:
        self.helm = helm
        server = LocalServer(tmp_path / "status.sock")
        world = helm.world
        challenges = Challenges(key, VESSEL, os.urandom)
        self.service = StatusService(server, world.app, challenges, say=world.tell)
        tick = world.loop_app.tick

        def watched(now_us: int, **more: Any) -> object:
            snapshot = tick(now_us, **more)
            self.service.update(snapshot)  # type: ignore[arg-type]
            return snapshot

        world.loop_app.tick = watched  # type: ignore[method-assign]
        self.client = Client(server.path, wait_s=0.001)
        PAGES.append(self)

    def ask(self, **message: Any) -> dict[str, Any]:
        self.client.ask(id=7, **message)
        for _ in range(40):
            self.helm.step()
            for found in self.client.poll():
                if found.get("id") == 7:
                    return found
        raise AssertionError("NOT HEARD")

    def challenge(self) -> dict[str, str]:
        found: dict[str, str] = self.ask(ask="challenge")["challenge"]
        return found

    def order(self, order: str, key: bytes = KEY) -> dict[str, Any]:
        challenge = self.challenge()
        response = answer_to(challenge, order, key)
        return self.ask(ask="order", order=order, nonce=challenge["nonce"], response=response, host="10.0.0.7")


def test_hold_and_disarm_are_obeyed_with_the_key_and_the_vessel_proves_it(tmp_path: Path) -> None:
    page = Page(under_way(), tmp_path)
    challenge = page.challenge()
    response = answer_to(challenge, "hold")
    found = page.ask(ask="order", order="hold", nonce=challenge["nonce"], response=response, host="10.0.0.7")
    told = f"usv-companion page answer 1\n{VESSEL}\n{challenge['nonce']}\nobeyed"
    assert found["answer"]["outcome"] == "obeyed"
    assert found["answer"]["tag"] == hmac.new(KEY, told.encode(), hashlib.sha256).hexdigest()
    assert page.helm.world.app.vehicle.parts.navigator.mode is Mode.HOLD
    page.helm.run(20.0)
    assert page.helm.truth.u_mps < 0.3
    assert "Hold: ordered by the page at 10.0.0.7" in page.helm.texts()
    assert page.order("disarm")["answer"]["outcome"] == "obeyed"
    assert not page.helm.world.app.vehicle.controls.armed
    page.helm.run(1.0)
    assert set(page.helm.pulses_us[:2]) == {1500}


def test_nothing_is_obeyed_without_the_key_too_late_twice_or_as_another_order(tmp_path: Path) -> None:
    page = Page(under_way(), tmp_path)
    assert page.order("hold", bytes(32))["refused"] == "wrong key"
    challenge = page.challenge()
    hold = answer_to(challenge, "hold")
    assert "wrong key" in page.ask(ask="order", order="disarm", nonce=challenge["nonce"], response=hold)["refused"]
    other = {**challenge, "vessel": "00" * 16}
    wrong = answer_to(other, "hold")
    assert "wrong key" in page.ask(ask="order", order="hold", nonce=challenge["nonce"], response=wrong)["refused"]
    arm = page.challenge()
    assert (
        "Hold and Disarm only"
        in page.ask(ask="order", order="arm", nonce=arm["nonce"], response=answer_to(arm, "arm"))["refused"]
    )
    late = page.challenge()
    page.helm.run(LIFE_US * 1e-6 + 0.1)
    assert (
        "too late"
        in page.ask(ask="order", order="hold", nonce=late["nonce"], response=answer_to(late, "hold"))["refused"]
    )
    assert page.helm.world.app.vehicle.parts.navigator.mode is Mode.AUTO
    assert page.helm.texts().count("wrong key from") == 1
    first = page.challenge()
    response = answer_to(first, "hold")
    assert "answer" in page.ask(ask="order", order="hold", nonce=first["nonce"], response=response)
    assert page.helm.command(SET_MODE, 1.0, AUTO) == 0
    disarm = answer_to(first, "disarm")
    assert "heard before" in page.ask(ask="order", order="disarm", nonce=first["nonce"], response=disarm)["refused"]
    page.ask(ask="order", order="hold", nonce=first["nonce"], response=response)
    assert page.helm.world.app.vehicle.parts.navigator.mode is Mode.AUTO
    assert page.helm.world.app.vehicle.controls.armed


@pytest.mark.parametrize("order", ["hold", "check"])
@pytest.mark.parametrize("later", [(), ("disarm",)])
def test_an_order_that_is_said_again_is_answered_as_the_first_time_and_carried_out_once(
    order: str, later: tuple[str, ...], tmp_path: Path
) -> None:
    """A browser says it again when its connection broke before the answer: at once, and when the challenge is long dead."""
    page = Page(under_way(), tmp_path)
    challenge = page.challenge()
    page.helm.run(LIFE_US * 1e-6 - 1.0)
    words = {"order": order, "nonce": challenge["nonce"], "response": answer_to(challenge, order, page="a")}
    page.client.ask(id=6, ask="order", page="a", **words)  # the same tick brings it twice
    first = page.ask(ask="order", page="a", **words)
    assert first["answer"]["outcome"] == "obeyed"
    for each in later:
        assert page.order(each)["answer"]["outcome"] == "obeyed"
    page.helm.run(2.0)
    assert page.ask(ask="order", page="a", **words)["answer"] == first["answer"]
    assert page.helm.texts().count("Hold: ordered by the page") == (order == "hold")
    page.helm.run(LIFE_US * 1e-6)
    assert "too late" in page.ask(ask="order", page="a", **words)["refused"]


def test_a_refusal_of_the_vessel_is_told_again_too() -> None:
    """What it refuses is no order that was heard before, and the answer waits for the vessel's tick as the first one does."""
    challenges = Challenges(KEY, VESSEL, random.Random(9).randbytes)
    nonce = challenges.challenge(0)
    words = answer_to({"vessel": VESSEL, "nonce": nonce}, "hold")
    assert challenges.judge("hold", nonce, words, 0) is PageOrder.HOLD
    again = challenges.judge("hold", nonce, words, 1)
    assert isinstance(again, HeardOrder)
    told: list[dict[str, Any]] = []
    again.tell(told.append)
    assert told == []
    answer = challenges.answered(nonce, "refused: no position", t_s=0.1)
    again.tell(told.append)
    assert told == [answer, answer]


def test_an_order_that_was_held_up_does_not_overtake_a_later_one_of_the_same_page(tmp_path: Path) -> None:
    """Disarm is kept on the way, Hold goes past it: the boat that holds is not set adrift by a press of before."""
    page = Page(under_way(), tmp_path)
    disarm = page.challenge()
    page.helm.run(1.0)
    hold = page.challenge()
    for challenge, order, outcome in (
        (hold, "hold", "obeyed"),
        (disarm, "disarm", LATER),
    ):
        words = {"order": order, "nonce": challenge["nonce"], "response": answer_to(challenge, order, page="a")}
        found = page.ask(ask="order", page="a", **words)
        assert found.get("refused", found.get("answer", {}).get("outcome")) == outcome
    assert page.helm.world.app.vehicle.controls.armed
    assert page.helm.world.app.vehicle.parts.navigator.mode is Mode.HOLD


@pytest.mark.parametrize(("one", "other"), [("a", "b"), ("", "")])
def test_an_order_is_not_held_back_by_somebody_elses(one: str, other: str, tmp_path: Path) -> None:
    page = Page(under_way(), tmp_path)
    disarm, hold = page.challenge(), page.challenge()
    for challenge, order, name in ((hold, "hold", one), (disarm, "disarm", other)):
        words = {"order": order, "nonce": challenge["nonce"], "response": answer_to(challenge, order, page=name)}
        assert page.ask(ask="order", page=name, **words)["answer"]["outcome"] == "obeyed"
    assert not page.helm.world.app.vehicle.controls.armed


def test_of_two_challenges_of_one_tick_the_later_one_is_known() -> None:
    """Disarm is kept on the way, and Hold was pressed at once: both were asked for before the vessel's next tick."""
    for seed in range(50):
        challenges = Challenges(KEY, VESSEL, random.Random(seed).randbytes)
        disarm, hold = challenges.challenge(70), challenges.challenge(70)
        for order, nonce in (("hold", hold), ("disarm", disarm)):
            words = answer_to({"vessel": VESSEL, "nonce": nonce}, order, page="a")
            judged = challenges.judge(order, nonce, words, 100, page="a")
            assert judged == (PageOrder.HOLD if order == "hold" else RefusedOrder(LATER))


@pytest.mark.parametrize("name", ["", "b", "a\n"])
def test_nobody_on_the_way_gives_an_order_another_pages_name(name: str, tmp_path: Path) -> None:
    """Else whoever carries a Disarm could hold it up, and let it follow the Hold that was pressed after it."""
    page = Page(under_way(), tmp_path)
    disarm, hold = page.challenge(), page.challenge()
    words = {"order": "hold", "nonce": hold["nonce"], "response": answer_to(hold, "hold", page="a")}
    assert page.ask(ask="order", page="a", **words)["answer"]["outcome"] == "obeyed"
    words = {"order": "disarm", "nonce": disarm["nonce"], "response": answer_to(disarm, "disarm", page="a")}
    assert "refused" in page.ask(ask="order", page=name, **words)
    assert page.helm.world.app.vehicle.controls.armed


def test_a_page_that_was_loaded_before_names_were_proved_is_obeyed(tmp_path: Path) -> None:
    page = Page(under_way(), tmp_path)
    challenge = page.challenge()
    text = f"usv-companion page order 1\n{VESSEL}\n{challenge['nonce']}\nhold"
    response = hmac.new(KEY, text.encode(), hashlib.sha256).hexdigest()
    found = page.ask(ask="order", order="hold", nonce=challenge["nonce"], response=response, page="a")
    assert found["answer"]["outcome"] == "obeyed"


def test_what_is_kept_of_pages_lives_no_longer_than_their_orders() -> None:
    chance = random.Random(9)
    challenges = Challenges(KEY, VESSEL, chance.randbytes)
    for number in range(2_000):
        now_us = number * LIFE_US
        nonce = challenges.challenge(now_us)
        words = answer_to({"vessel": VESSEL, "nonce": nonce}, "hold", page=f"{number}")
        assert challenges.judge("hold", nonce, words, now_us, page=f"{number}") is PageOrder.HOLD
    assert len(challenges._newest) <= 2


def test_a_vessel_without_a_key_takes_no_order(tmp_path: Path) -> None:
    page = Page(under_way(), tmp_path, key=None)
    assert "only shows" in page.order("hold")["refused"]
    assert page.helm.world.app.vehicle.parts.navigator.mode is Mode.AUTO


def test_the_page_keeps_no_failsafe_asleep_and_gets_no_command(tmp_path: Path) -> None:
    """Pressed and read all the time, while the station is silent: the failsafe acts when it would have acted."""
    helm = under_way()
    page = Page(helm, tmp_path)
    commander = helm.world.app.vehicle.parts.operators.commander
    helm.present = False
    began_s, told_s = helm.now_s, 0.0
    while helm.now_s - began_s < 12.0:
        page.order("hold")
        helm.run(0.4)
        if not told_s and "gcs_lost" in helm.world.app.snapshot.causes:  # type: ignore[union-attr]
            told_s = helm.now_s - began_s
    assert told_s == pytest.approx(5.0, abs=1.6)
    assert helm.world.app.vehicle.parts.operators.commander == commander


def test_hold_on_the_page_ends_a_return_for_want_of_a_station(tmp_path: Path) -> None:
    helm = under_way("failsafe.gcs_then_s=5")
    page = Page(helm, tmp_path)
    helm.present = False
    helm.until(lambda: helm.world.app.snapshot.action is Action.RETURN, 30.0)  # type: ignore[union-attr]
    helm.run(10.0)
    assert page.order("hold")["answer"]["outcome"] == "obeyed"
    helm.run(20.0)
    here = helm.truth.north_m, helm.truth.east_m
    helm.run(60.0)
    assert math.dist(here, (helm.truth.north_m, helm.truth.east_m)) < 5.0


def test_hold_on_the_page_starts_no_propellers_of_a_boat_that_a_failsafe_has_stopped(tmp_path: Path) -> None:
    helm = under_way("world.water.wind_mps=5")
    page, faults = Page(helm, tmp_path), helm.world.surroundings.plant.sensors.faults
    faults.set("gnss_silent", True)
    helm.until(lambda: helm.world.snapshot.action is Action.STOP, 20.0)
    faults.set("gnss_silent", False)
    helm.run(12.0)
    words = "she lies stopped: position lost; Hold by a station would hold her"
    assert page.order("hold")["answer"]["outcome"] == words
    for _ in range(4):
        helm.run(1.0)
        output = helm.world.snapshot.output
        assert (output.thruster_port, output.thruster_starboard) == (0.0, 0.0)
    assert helm.world.snapshot.mode is Mode.HOLD, "what sets her going again does not sail on"


def test_an_order_of_the_page_stands_in_the_runs_events_with_its_address_and_replays(tmp_path: Path) -> None:
    from companion.replay import replay

    run_dir = tmp_path / "run"
    helm = under_way_recorded(run_dir)
    page = Page(helm, tmp_path)
    page.order("hold", b"\x01" * 32)
    page.order("hold")
    helm.run(3.0)
    helm.world.shutdown(0)
    events = [json.loads(line) for line in (run_dir / "events.jsonl").read_text().splitlines()]
    orders = [event for event in events if event["event"] == "order" and event.get("link") == "page"]
    assert [(event["host"], event["proof"], event["result"]) for event in orders] == [
        ("10.0.0.7", "page key", "ACCEPTED")
    ]
    assert replay(run_dir).identical


def under_way_recorded(run_dir: Path) -> Helm:
    return Helm("ardurover", "depth.enabled=false", run_dir=run_dir)


def test_nobody_guesses_an_order() -> None:
    """Nonces and responses made of right ones, cut, mixed, of other lives: none is an order."""
    chance = random.Random(5)
    vessel, before = (Challenges(KEY, VESSEL, chance.randbytes) for _ in range(2))
    for number in range(5_000):
        now_us = number * 10_000
        nonce, old = vessel.challenge(now_us), before.challenge(now_us)
        right = answer_to({"vessel": VESSEL, "nonce": nonce}, "hold")
        tried = chance.choice(
            [
                (nonce, right[:-1] + chance.choice("0123456789abcdef".replace(right[-1], ""))),
                (nonce, ""),
                (nonce, right.upper().replace("A", "a")),
                (old, answer_to({"vessel": VESSEL, "nonce": old}, "hold")),
                (f"{now_us + 1:016x}{nonce[16:]}", right),
                (nonce[:32] + old[32:], right),
                (chance.randbytes(32).hex(), right),
                ("é" * 64, right),
                (nonce[:63], right),
            ]
        )
        if tried == (nonce, right):
            continue
        assert isinstance(vessel.judge("hold", tried[0], tried[1], now_us + 1), RefusedOrder)

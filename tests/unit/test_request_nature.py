"""What a request means to the boat's safety is said once, beside the request, and every way to the vessel obeys it."""

from __future__ import annotations

import itertools
import typing

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.commands.command import Command, Refused
from mavlink_bridge.mavlink.commands.table import MAY_STOP, MEANINGS, Context
from mavlink_bridge.radio.codec.wire import Kind
from tools.lora_rig import Rig, profile

MEMBERS = typing.get_args(ask.RequestBody)
HERE = Context(home_item=True, plan_length=3, plan_seq=0, psi_rad=0.0)
STOPS = [
    ask.SetMode(Mode.HOLD),
    ask.SetMode(Mode.LOITER),
    ask.Reposition(None, None),
    ask.PausePlan(pause=True),
    ask.Arm(False),
    ask.Arm(False, force=True),
    ask.Terminate(),
]


@pytest.mark.parametrize("member", MEMBERS, ids=lambda member: member.__name__)
def test_every_request_says_its_own_nature(member: type[object]) -> None:
    assert "nature" in vars(member)


def test_a_request_that_says_nothing_of_itself_cannot_be_made() -> None:
    class Silent(ask.Ask):
        pass

    with pytest.raises(TypeError):
        Silent()  # type: ignore[abstract]


@pytest.mark.parametrize("body", STOPS, ids=repr)
def test_a_stop_is_void_by_no_later_stop(body: ask.RequestBody) -> None:
    assert body.nature.stops
    assert not body.nature.yields


def meanings(number: int) -> set[bool]:
    """Whether what a command may mean stops the boat, for many parameters."""
    found = set()
    nowhere = float("nan")
    for first, second, x in itertools.product(
        (0.0, 1.0, 2.0, 20.0), (-1.0, 0.0, 4.0, 5.0, 9.0, 21196.0), (0.0, nowhere)
    ):
        command = Command(number, (first, second, 0.0, 0.0), x, x, 0.0, None, (255, 190))
        try:
            body = MEANINGS[number](command, HERE)
        except Refused:
            continue
        if body is not None:
            found.add(body.nature.stops)
    return found


@pytest.mark.parametrize("number", sorted(MEANINGS))
def test_the_numbers_that_may_stop_are_those_whose_meaning_may(number: int) -> None:
    assert (number in MAY_STOP) == (True in meanings(number))


@pytest.mark.parametrize("body", [ask.SetMode(Mode.LOITER), ask.Reposition(None, None)], ids=repr)
def test_loiter_and_hold_here_cross_the_radio_as_stops(body: ask.RequestBody) -> None:
    """They use the stop's priority, and void a go-to that is still on its way."""
    rig = Rig(profile("o-10"))
    rig.settle()
    rig.twin.submit("go", ask.Reposition(0.7, -0.15), rig.now_us)
    since_us = rig.now_us
    _, reply = rig.ask(body)
    rig.run(5.0)
    assert reply == ask.ACCEPTED
    kinds = [item.data[0] >> 4 for item in rig.pair.air.log if item.origin == "shore" and item.start_us >= since_us]
    assert Kind.STOP in kinds
    assert [done for _, done in rig.vessel.executed] == [body]
    assert [answer.reason for _, owner, answer in rig.replies if owner == "go"] == ["overruled by a stop"]

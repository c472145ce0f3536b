"""A vessel that hears another one under its own key and number says so aboard: nobody else can tell why no gateway finds them."""

from __future__ import annotations

import random

import pytest

from mavlink_bridge.radio.aboard import VesselRadio
from mavlink_bridge.radio.codec.frames import Opener, Sealer
from mavlink_bridge.radio.session import Pairing, RadioDirection
from tools.lora_rig import KEY, Rig, profile

TOLD = "Radio: another boat has this key and number 1: give each its own system.system_id"


def greetings(*, system_id: int = 1, key: bytes = KEY, seconds: float = 30.0) -> tuple[Rig, list[str]]:
    """One vessel with its gateway, and a second vessel whose every word it hears; what the first one says aboard."""
    rig = Rig(profile("o-10"))
    other = VesselRadio(rig.profile, key, rig.vessel, random.Random(5), nonce=b"second", system_id=system_id)
    for _ in range(round(seconds * 100)):
        rig.step()
        rig.radio.receive(other.take(rig.now_us, 1200), rig.now_us)
    return rig, rig.told


def test_another_vessel_of_the_same_key_and_number_is_told_of_now_and_then() -> None:
    rig, told = greetings(seconds=90.0)
    assert told == [TOLD]
    assert len(TOLD) <= 100
    assert rig.twin.is_fresh(rig.now_us), "and does no more"


@pytest.mark.parametrize("other", [{"system_id": 2}, {"key": bytes(range(2, 34))}])
def test_a_vessel_of_another_number_or_key_is_none_of_ours(other: dict[str, int | bytes]) -> None:
    assert greetings(**other)[1] == []  # type: ignore[arg-type]


def test_one_that_answers_our_gateway_is_told_of_too() -> None:
    """Its greeting proves itself to the gateway, whose own one this vessel has heard."""
    rig = Rig(profile("o-10"))
    rig.settle()
    other = Pairing(KEY, 1, RadioDirection.TO_SHORE, b"second", rig.profile)
    shore = Sealer(rig.twin.link.pairing).hello(rig.twin.link.pairing.hello(0, please=True, proof=False)[0], b"")
    Opener(other).receive(shore, rig.now_us)
    rig.radio.receive(Sealer(other).hello(*other.hello(rig.now_us, please=False, proof=True)), rig.now_us)
    assert rig.told == [TOLD]


def test_its_own_echo_and_recording_of_a_gateway_is_no_other_vessel() -> None:
    rig = Rig(profile("o-10"))
    for _ in range(6000):
        rig.step()
        for item in rig.pair.air.log:
            if item.end_us // 10_000 == rig.now_us // 10_000:
                rig.radio.receive(item.data, rig.now_us)
    assert rig.told == []

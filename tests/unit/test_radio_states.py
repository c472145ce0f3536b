"""What the vessel's states refer to: the shore's beacons keep it fresh, so no long key comes, and nothing is ever put together wrongly."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.radio.codec.wire import OVERHEAD, Kind
from sitl.radio import RadioConfig
from tools.benches.lora import settled
from tools.lora_rig import Rig

HURRIED = OVERHEAD + 8
"""A difference with a status: the longest state that an order should have to wait for."""


def states(rig: Rig, since_us: int) -> list[int]:
    kinds = (Kind.KEY, Kind.DELTA)
    log = (item for item in rig.pair.air.log if item.origin == "vessel" and item.start_us >= since_us)
    return [
        len(item.data)
        for item in log
        if item.data[0] >> 4 in kinds and int.from_bytes(item.data[:2], "big") >> 6 & 63 < 56
    ]


def metres_off(rig: Rig) -> float:
    """How far the vessel is from where the shore shows it."""
    shown, state = rig.twin.state, rig.vessel.snapshot(rig.now_us, 0).state
    assert shown is not None
    assert shown.lat_rad is not None
    assert shown.lon_rad is not None
    assert state.lat_rad is not None
    assert state.lon_rad is not None
    north = (shown.lat_rad - state.lat_rad) * 6_371_000.0
    return math.hypot(north, (shown.lon_rad - state.lon_rad) * 6_371_000.0 * math.cos(state.lat_rad))


def test_minutes_go_by_without_a_key_and_another_status_needs_none() -> None:
    """It is on the air for 461 ms: what has to wait for it comes too late for a station's 1.3 s."""
    rig = settled()
    since_us = rig.now_us
    rig.run(120.0)
    rig.vessel.mode = Mode.HOLD
    rig.run(40.0)
    sizes = states(rig, since_us)
    assert max(sizes) <= HURRIED
    assert sizes[-1] == OVERHEAD + 4, "the shore's word has made differences short again"
    assert rig.twin.state is not None
    assert rig.twin.state.mode is Mode.HOLD
    rig.run(120.0)
    whole = [size for size in states(rig, since_us) if size > HURRIED]
    assert len(whole) == 1, "what only a key tells comes now and then"


def sail_and_look(seed: int, seconds: int) -> None:
    """Keys, words that name them and differences are lost; what the shore shows is where the boat was when it last came."""
    rig = settled(seed=seed)
    rig.pair.air.configure(RadioConfig(loss=0.4))
    modes, seen_us = (Mode.AUTO, Mode.HOLD, Mode.GUIDED), None
    for second in range(seconds):
        rig.vessel.mode = modes[second // 37 % 3]
        for _ in range(100):
            rig.step()
            if rig.twin.state_us != seen_us:
                seen_us = rig.twin.state_us
                assert metres_off(rig) < 3.0
                assert rig.twin.state is not None
                assert second % 37 < 2 or rig.twin.state.mode is rig.vessel.mode


def test_whatever_is_lost_no_state_is_put_together_wrongly() -> None:
    sail_and_look(0, 150)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 13))
def test_whatever_is_lost_no_state_is_put_together_wrongly_for_hours(seed: int) -> None:
    sail_and_look(seed, 1800)

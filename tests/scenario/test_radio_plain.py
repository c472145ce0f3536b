"""Plain MAVLink on the shore modem's port, in virtual time: MAVSDK's timers at every phase, losses, more than an hour on end."""

from __future__ import annotations

import itertools
import json
import random

import pytest

import config as shipped
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanKind, StartPlan
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.radio.air.ledger import HOUR_US
from mavlink_bridge.radio.memory import KeptLedger
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.fake_vessel import FakeVessel, Station
from tests.mavsdk_like import MavsdkLike
from tests.plain_rig import PLAN, PlainRig
from tests.qgc_client import QgcClient


def story(seed, *, limit_s=120.0, **radio):
    """Upload, read back, arm, set the mode, start; the seconds it took, the steps that had to be tried again, and the rig."""
    station = MavsdkLike(PLAN, phase_us=random.Random(seed).randrange(1_000_000))
    rig = PlainRig(station, seed=seed, **radio)
    while not station.finished and rig.now_us < limit_s * 1e6:
        rig.step()
    return rig.now_us * 1e-6, sum("failed" in text for _, text in station.log), rig


def assert_sails(rig):
    vessel = rig.vessel
    assert rig.station.finished, rig.station.log
    assert (vessel.mode, vessel.armed) == (Mode.AUTO, True)
    assert len(vessel.plans.items(PlanKind.MISSION)) == 2
    assert [item.command for item in rig.station.read_back] == [16, 178, 19]


@pytest.mark.parametrize(("loss", "mean_s"), [(0.0, 12.0), (0.1, 16.0), (0.3, 25.0)])
def test_mavsdk_plans_and_starts_whatever_the_phase_of_its_timers(loss, mean_s):
    found = [story(seed, loss=loss) for seed in range(40)]
    for _, _, rig in found:
        assert_sails(rig)
    seconds, again = [item[0] for item in found], [item[1] for item in found]
    print(
        f"loss {loss:.0%}: {sum(seconds) / 40:.1f} s on average, {max(seconds):.1f} at most, {sum(again)} steps again"
    )
    assert sum(seconds) / 40 < mean_s


def test_an_order_is_carried_out_once_however_often_it_is_repeated():
    for seed in range(20):
        _, again, rig = story(seed, loss=0.2)
        bodies = [request.body for request in rig.vessel.handled]
        tries = 1 + again
        for kind in (Arm, StartPlan, LoadPlan):
            assert 1 <= sum(isinstance(body, kind) for body in bodies) <= tries


@pytest.mark.parametrize(("phy", "listen"), [("SF8", False), ("SF9", True)])
def test_slower_air(phy, listen):
    """3.1 kbit/s with modules that do not listen, 1.8 kbit/s with modules that do."""
    for seed in range(12):
        assert_sails(story(seed, limit_s=200.0, phy=phy, listen_first=listen)[2])


class Idle(Station):
    """A station that does nothing but show that it is there."""

    def __init__(self) -> None:
        super().__init__()
        self._beat_us = 0

    def take(self, now_us: int) -> bytes:
        if now_us < self._beat_us:
            return b""
        self._beat_us += 1_000_000
        return self.codec.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))


def heard_s(rig, number):
    """When messages of an id came from the vessel to the station."""
    return [
        item.end_us * 1e-6
        for item in rig.pair.air.log
        if item.origin == "vessel" and item.fate == "received"
        for frame in Deframer().receive(item.data, item.end_us)
        if frame.message_id == number
    ]


def test_more_than_an_hour_slows_down_and_never_falls_silent():
    rig = PlainRig(Idle(), is_talkative=False)
    while rig.now_us < 4 * HOUR_US // 3:
        rig.step()
        rig.vessel.changes = {"armed": rig.now_us // 60_000_000 % 2 == 1}
    beat_s, position_s = (
        max(later - earlier for earlier, later in itertools.pairwise(heard_s(rig, number))) for number in (0, 33)
    )
    print(f"longest silence: HEARTBEAT {beat_s:.1f} s, position {position_s:.1f} s")
    assert beat_s < 3.5
    assert position_s < 60.0
    assert rig.pair.air.worst_hour_us("vessel") <= 0.1 * HOUR_US


def test_the_ledger_outlives_a_restart():
    kept = [""]
    ledger = KeptLedger(360_000_000, "", lambda text: kept.__setitem__(0, text))
    rig = PlainRig(Idle(), ledger=ledger, is_talkative=False)
    rig.run(600.0)
    used_us = ledger.used_us(rig.now_us)
    again = KeptLedger(360_000_000, kept[0], lambda text: None)
    assert used_us - 4_000_000 <= again.used_us(0) <= used_us + 4_000_000
    assert json.loads(kept[0])
    damaged = KeptLedger(360_000_000, '{"air":', lambda text: None)
    assert damaged.used_us(0) == 360_000_000


def test_a_stop_is_acknowledged_from_the_reserve():
    spent = KeptLedger(360_000_000, "", lambda text: None)
    spent.charge(290_000_000, 0)
    station = Idle()
    rig = PlainRig(station, ledger=spent, vessel=FakeVessel(armed=True))
    rig.run(5.0)
    for command in (300, 400):
        rig.pair.shore.write(
            station.codec.encode(dialect.MAVLink_command_long_message(1, 1, command, 0, 0, 0, 0, 0, 0, 0, 0))
        )
        rig.run(3.0)
    assert [message.command for message in station.all("COMMAND_ACK")] == [400]
    assert not rig.vessel.armed


@pytest.mark.parametrize(("phy", "seed"), [("SF7", 0), ("SF7", 2), ("SF8", 1)])
def test_qgroundcontrol_connects_and_uploads(phy, seed):
    """Its connect asks for everything first; a hundred parameters at 5.5 kbit/s are most of it."""
    client = QgcClient()
    rig = PlainRig(client, phy=phy, seed=seed)
    client.then(client.upload(0, PLAN))
    while rig.now_us < 120e6 and not rig.vessel.plans.plan_id(PlanKind.MISSION):
        rig.step()
    print(f"{phy}: plan aboard after {rig.now_us * 1e-6:.0f} s, {len(client.report.params)} parameters")
    assert rig.vessel.plans.plan_id(PlanKind.MISSION)
    while not client.idle and rig.now_us < 180e6:
        rig.step()
    for command, params in ((400, (1.0,)), (300, (0.0, 0.0))):
        results = []
        while 0 not in results and len(results) < 6:
            client.start(client.command(command, *params))
            while not client.idle:
                rig.step()
            results.append(client.result)
        assert 0 in results
    assert rig.vessel.mode is Mode.AUTO


def test_a_plan_cannot_be_uploaded_over_the_radio_and_a_lan_link_at_once():
    world = World(load(shipped.path("sim.toml"), (), SimSettings), 1)
    world.run(0.2)
    lan, radio = (port.conversations[0] for port in (world.app.grounds[0], world.app.grounds[-1]))
    count = dialect.MAVLink_mission_count_message(1, 1, 3, 0)
    lan.receive(Codec(255, 190).encode(count), world.now_us)
    radio.receive(Codec(254, 190).encode(count), world.now_us)
    said = b""
    for _ in range(40):
        world.now_us += 50_000
        said += radio.take(world.now_us, 300)
    acks = [decode(frame) for frame in Deframer().receive(said, world.now_us) if frame.message_id == 47]
    assert [(ack.target_system, ack.type) for ack in acks] == [(254, dialect.MAV_MISSION_DENIED)]

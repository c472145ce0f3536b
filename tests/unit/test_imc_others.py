"""Other vessels at an IMC console: each AIS_VESSEL once, read by a codec that nobody here wrote."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import imcpy
import pytest

from companion.imc.others import KEPT, Others
from companion.imc.picture import ImcPicture
from mavlink_bridge import imc
from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.mavlink.telemetry.traffic import ais_vessel
from tests.imc_node_rig import UTC_S, ConsoleRig, make_node
from tests.unit.test_imc_state_out import attitude, heartbeat, position
from tests.unit.test_traffic_mavlink import EXAMPLE, unpacked

S = 1_000_000


class Console:
    """A console on a node that tells of other vessels; packets as imcpy reads them."""

    def __init__(self) -> None:
        self.node, self.picture = make_node(), ImcPicture()
        self.others = Others(self.picture)
        self.node.add(self.others)
        self.rig = ConsoleRig(self.node)
        self.rig.announce(0)
        self.rig.got.clear()

    def hear(self, now_us: int, *messages: Any) -> list[Any]:
        for message in messages:
            self.picture.hear(message, now_us)
            self.others.hear(message, now_us)
        return self.told(self.rig.take(now_us))

    @staticmethod
    def told(packets: list[Any]) -> list[Any]:
        read = [imcpy.Packet.deserialize(imc.encode(packet)) for packet in packets]
        return [message for message in read if isinstance(message, imcpy.AisInfo)]


def vessel(**changes: Any) -> Any:
    return unpacked(ais_vessel(replace(EXAMPLE, **changes), 10_000_000))


def test_a_vessel_is_told_in_the_units_of_the_definition_with_the_time_of_her_report() -> None:
    console = Console()
    (told,) = console.hear(S, heartbeat(), position(41.2, -8.7), attitude(), vessel())
    assert (told.msg_type, told.mmsi, told.name, told.callsign) == ("1", "244123456", "MV EXAMPLE", "PABC")
    assert (told.nav_status, told.type_and_cargo) == (0, 70)
    assert math.degrees(told.lat) == pytest.approx(41.1852, abs=1e-7)
    assert (told.course, told.speed) == pytest.approx((271.4, 12.3), abs=0.02)
    assert (told.a, told.b, told.c, told.d) == (100.0, 50.0, 10.0, 10.0)
    metres, _ = inverse(math.radians(41.2), math.radians(-8.7), told.lat, told.lon)
    assert told.dist == pytest.approx(metres, abs=1.0)
    assert told.timestamp == pytest.approx(UTC_S + 1 - 3, abs=0.01)


def test_what_she_did_not_say_is_ais_own_number_for_it() -> None:
    (told,) = Console().hear(S, vessel(sog_mps=None, cog_rad=None, sides=None, status=None, name="", callsign=""))
    assert (told.course, told.nav_status, told.a, told.name) == (360.0, 15, 0.0, "")
    assert told.speed == pytest.approx(102.3)
    assert told.dist == -1.0


def test_each_report_is_told_once_and_all_to_a_console_that_comes() -> None:
    console = Console()
    assert len(console.hear(S, vessel(), vessel(mmsi=265000001))) == 2
    assert console.hear(2 * S) == []
    second = ConsoleRig(console.node, "10.77.0.9", 0x4002, "ccu-b")
    told = console.told([*second.announce(3 * S), *second.take(3 * S)])
    assert {each.mmsi for each in told} == {"244123456", "265000001"}


def test_a_flood_is_bounded() -> None:
    console = Console()
    for number in range(3 * KEPT):
        console.others.hear(vessel(mmsi=number + 1), S)
    assert len(console.others.take(S)) == KEPT

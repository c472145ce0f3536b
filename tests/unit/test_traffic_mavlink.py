"""Other vessels as ground stations receive them: bytes, rates, and what must not be sent."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from mavlink_bridge.language.messages import Action, ActuatorOutput, EstimatedState, Mode
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.traffic import Danger, OtherVessel, Sides, TrafficPicture, VesselKind
from mavlink_bridge.language.units import KNOT_MPS
from mavlink_bridge.mavlink.persona import EndpointConfig
from mavlink_bridge.mavlink.telemetry.outbox import Outbox
from mavlink_bridge.mavlink.telemetry.traffic import TrafficTeller, adsb_vehicle, ais_vessel, collision
from mavlink_bridge.mavlink.wire.codec import Codec, dialect

EXAMPLE = OtherVessel(
    mmsi=244123456,
    kind=VesselKind.CLASS_A,
    t_us=10_000_000,
    lat_rad=math.radians(41.1853),
    lon_rad=math.radians(-8.7070),
    reported_lat_rad=math.radians(41.1852),
    reported_lon_rad=math.radians(-8.7060),
    reported_us=7_000_000,
    sigma_m=12.0,
    sog_mps=12.3 * KNOT_MPS,
    cog_rad=math.radians(271.4),
    heading_rad=math.radians(270.0),
    turn_radps=0.0,
    accurate=True,
    status=0,
    ship_type=70,
    sides=Sides(100, 50, 10, 10),
    name="MV EXAMPLE",
    callsign="PABC",
    range_m=500.0,
    bearing_rad=0.5,
)


def test_an_ais_vessel_is_byte_for_byte_the_vector() -> None:
    vector = "fd3000000001012d010040078d0ee05c8c18e091cffa046a7869790264003200030057180000460a0a504142430000004d56204558414d504c45cc61"
    frame = Codec(1, 1).seal_all([ais_vessel(EXAMPLE, 10_000_000)])
    assert frame.hex() == vector


def unpacked(made: tuple[int, bytes]) -> Any:
    number, payload = made
    codec = dialect.MAVLink(None)
    frame = Codec(1, 1).seal_all([(number, payload)])
    (message,) = codec.parse_buffer(frame)
    return message


def test_what_is_unknown_is_flagged_as_such() -> None:
    vessel = replace(
        EXAMPLE,
        sog_mps=None,
        cog_rad=None,
        heading_rad=None,
        turn_radps=None,
        status=None,
        sides=None,
        name="",
        callsign="",
    )
    message = unpacked(ais_vessel(vessel, 10_000_000))
    assert (message.flags, message.velocity, message.COG, message.heading) == (1, 0, 0, 65535)
    assert message.navigational_status == 15


def test_faster_larger_and_turning_without_a_value() -> None:
    vessel = replace(
        EXAMPLE,
        sog_mps=102.2 * KNOT_MPS,
        sog_is_least=True,
        turn_radps=None,
        turn_sign=-1,
        sides=Sides(511, 511, 63, 63),
    )
    message = unpacked(ais_vessel(vessel, 10_000_000))
    assert message.velocity == 5258
    assert message.turn_rate == -1
    assert message.flags & (8 | 16 | 32 | 128 | 256 | 512 | 1024) == (8 | 16 | 32 | 128 | 256 | 512 | 1024)


def test_a_turn_in_tenths_of_degrees_a_second() -> None:
    message = unpacked(ais_vessel(replace(EXAMPLE, turn_radps=math.radians(3.0)), 0))
    assert message.turn_rate == 30


def test_qgroundcontrol_gets_the_place_of_now_and_a_name() -> None:
    message = unpacked(adsb_vehicle(EXAMPLE, 200_000_000))
    assert message.lat == 411853000
    assert message.tslc == 15
    assert message.callsign.rstrip("\0") == "MV EXAMP"
    assert message.flags == 1 | 2 | 4 | 8 | 16
    assert message.altitude == 0


@pytest.mark.parametrize(
    ("mmsi", "kind", "callsign"),
    [
        (972_263_001, VesselKind.PERSON, "MOB"),
        (970_263_001, VesselKind.PERSON, "SART"),
        (974_263_001, VesselKind.PERSON, "EPIRB"),
        (972_263_001, VesselKind.BEACON_TEST, "TEST MOB"),
    ],
)
def test_qgroundcontrol_names_a_persons_beacon_as_seamen_do(mmsi: int, kind: VesselKind, callsign: str) -> None:
    beacon = replace(EXAMPLE, mmsi=mmsi, kind=kind, name="")
    assert unpacked(adsb_vehicle(beacon, 10_000_000)).callsign.rstrip("\0") == callsign


def test_a_person_is_shown_however_far_and_however_many_vessels_have_risk() -> None:
    person = replace(EXAMPLE, mmsi=972_263_001, kind=VesselKind.PERSON, name="", range_m=5000.0)
    crowd = [replace(EXAMPLE, mmsi=number, danger=Danger.RISK, range_m=100.0) for number in range(1, 31)]
    link = Link()
    link.run(lambda now_us: TrafficPicture((person, *crowd), heard=True), 3.0)
    assert person.mmsi in {message.ICAO_address for _, message in link.got if message.get_type() == "ADSB_VEHICLE"}


def test_a_collision_is_reported_and_ended() -> None:
    message = unpacked(collision(replace(EXAMPLE, danger=Danger.CLOSE, cpa_m=12.0, tcpa_s=33.0)))
    assert (message.id, message.threat_level, message.action) == (244123456, 2, 1)
    assert (message.time_to_minimum_delta, message.horizontal_minimum_delta) == (33.0, 12.0)


class Link:
    """A link with a budget, and what came over it."""

    def __init__(self, profile: str = "lan") -> None:
        self.config = EndpointConfig(name="gcs", profile=profile)
        self.codec = Codec(1, 1)
        self.outbox = Outbox(self.config.limits, self.codec.seal_all, 12)
        self.teller = TrafficTeller(self.config, self.outbox)
        self.parser = dialect.MAVLink(None)
        self.got: list[tuple[float, Any]] = []

    def run(self, picture_at: Any, seconds: float, start_s: float = 0.0) -> None:
        for tick in range(round(seconds * 20)):
            now_us = round(start_s * 1e6) + tick * 50_000
            self.teller.tick(now_us, snapshot(now_us, picture_at(now_us)))
            for message in self.parser.parse_buffer(self.outbox.take(now_us, 1200)) or []:
                self.got.append((now_us * 1e-6, message))

    def times(self, name: str) -> list[float]:
        return [at_s for at_s, message in self.got if message.get_type() == name]


def snapshot(now_us: int, picture: TrafficPicture) -> Snapshot:
    state = EstimatedState(now_us)
    output = NEUTRAL
    return Snapshot(now_us, 0, state, Mode.HOLD, False, output, action=Action.NONE, traffic=picture)


NEUTRAL: Any = ActuatorOutput


def anchored(now_us: int) -> TrafficPicture:
    """She reported at the start and then every three minutes."""
    reported_us = now_us // 180_000_000 * 180_000_000
    return TrafficPicture(
        (replace(EXAMPLE, reported_us=reported_us, t_us=now_us // 1_000_000 * 1_000_000),), heard=True
    )


def test_an_anchored_vessel_stays_on_every_chart() -> None:
    """MAVProxy's forgets after 60 s, QGroundControl wants one a second."""
    link = Link()
    link.run(anchored, 600)
    ais = [*link.times("AIS_VESSEL"), 600.0]
    assert max(after - before for before, after in pairwise(ais)) <= 30.2
    assert len(link.times("AIS_VESSEL")) <= 30
    assert len(link.times("ADSB_VEHICLE")) == 600


@pytest.mark.parametrize("count", [1, 4])
def test_a_report_is_passed_on_within_a_second(count: int) -> None:
    def picture(now_us: int) -> TrafficPicture:
        reported_us = now_us // 10_000_000 * 10_000_000
        vessels = tuple(
            replace(EXAMPLE, mmsi=EXAMPLE.mmsi + n, reported_us=reported_us, t_us=now_us) for n in range(count)
        )
        return TrafficPicture(vessels)

    link = Link()
    link.run(picture, 60)
    for number in range(count):
        times = [at_s for at_s, m in link.got if m.get_type() == "AIS_VESSEL" and EXAMPLE.mmsi + number == m.MMSI]
        assert [at_s // 10 for at_s in times] == [0, 1, 2, 3, 4, 5]
        assert all(at_s % 10 <= 1.0 for at_s in times)


def test_two_hundred_vessels_do_not_fill_a_link_and_none_is_left_out() -> None:
    def picture(now_us: int) -> TrafficPicture:
        second_us = now_us // 1_000_000 * 1_000_000
        vessels = [
            replace(EXAMPLE, mmsi=1 + n, range_m=100.0 * n, reported_us=now_us // 10_000_000 + n, t_us=second_us)
            for n in range(200)
        ]
        return TrafficPicture(tuple(vessels))

    link = Link()
    link.run(picture, 60)
    ais = link.times("AIS_VESSEL")
    assert len(ais) <= 60 * 4 + 1
    told = Counter(m.MMSI for _, m in link.got if m.get_type() == "AIS_VESSEL")
    assert len(told) == 200
    assert len(link.times("ADSB_VEHICLE")) <= 20 * 61


def test_what_is_far_or_unsure_is_not_drawn_where_nobody_can_take_it_away() -> None:
    for vessel in (
        replace(EXAMPLE, range_m=2500.0),
        replace(EXAMPLE, sigma_m=150.0),
        replace(EXAMPLE, range_m=None),
        replace(EXAMPLE, kind=VesselKind.VIRTUAL_AID),
    ):
        link = Link()
        link.run(lambda now_us, vessel=vessel: TrafficPicture((vessel,)), 3)
        assert link.times("ADSB_VEHICLE") == []
    link = Link()
    link.run(lambda now_us: TrafficPicture((EXAMPLE,), as_adsb=False), 3)
    assert link.times("ADSB_VEHICLE") == []


def test_a_threat_is_told_each_second_and_its_end_once() -> None:
    near = replace(EXAMPLE, danger=Danger.RISK, cpa_m=15.0, tcpa_s=60.0)
    link = Link()
    link.run(lambda now_us: TrafficPicture((near,)), 10)
    link.run(lambda now_us: TrafficPicture((EXAMPLE,)), 5, start_s=10.0)
    levels = [m.threat_level for _, m in link.got if m.get_type() == "COLLISION"]
    assert levels[-1] == 0
    assert levels.count(0) == 1
    assert 10 <= levels.count(1) <= 11


def test_a_slow_link_hears_of_threats_only() -> None:
    near = replace(EXAMPLE, danger=Danger.RISK, cpa_m=15.0, tcpa_s=60.0)
    link = Link("lora")
    link.run(lambda now_us: TrafficPicture((near,)), 10)
    assert {m.get_type() for _, m in link.got} == {"COLLISION"}

"""Another vessel's danger over the slowest link: six bytes behind a state, back as a mark and a warning on shore."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mavlink_bridge.language.geodesy import inverse
from mavlink_bridge.language.traffic import TCPA_MOST_S, Danger, Role, TrafficPicture
from mavlink_bridge.radio.codec.bits import BitsError
from mavlink_bridge.radio.codec.state import decode_delta, decode_key, encode_delta, encode_key, settle
from mavlink_bridge.radio.codec.state_fields import RadioState
from mavlink_bridge.radio.codec.threat import decode_threat, encode_threat, picture_of, threat_of
from tests.unit.test_traffic_mavlink import EXAMPLE

NEAR = replace(
    EXAMPLE, danger=Danger.CLOSE, role=Role.STAND_ON, cpa_m=12.0, tcpa_s=48.0, range_m=320.0, bearing_rad=-1.2
)
THREAT = threat_of(TrafficPicture((NEAR,)))
STATE = RadioState(lat_rad=0.7, lon_rad=-0.15, sog_mps=1.5, psi_rad=0.3, alt_m=9.0, threat=THREAT)


def test_nobody_dangerous_costs_nothing() -> None:
    assert threat_of(TrafficPicture((EXAMPLE,))) is None
    assert threat_of(TrafficPicture()) is None
    assert len(encode_key(replace(STATE, threat=None))) == 16


def test_a_threat_takes_six_bytes_and_comes_back() -> None:
    assert len(encode_key(STATE)) == 22
    back = decode_key(encode_key(STATE)).threat
    assert (back.close, back.role, back.ship, back.number) == (True, Role.STAND_ON, True, EXAMPLE.mmsi & 0xFF)
    assert back.range_m == pytest.approx(320.0, rel=0.031)
    assert back.bearing_rad == pytest.approx(-1.2, abs=math.tau / 256)
    assert (back.cpa_m, back.tcpa_s) == (12.0, 48.0)
    assert back.sog_mps == pytest.approx(EXAMPLE.sog_mps, abs=0.38)


def test_what_is_too_far_ahead_for_the_air_has_no_time_on_shore() -> None:
    far = threat_of(TrafficPicture((replace(NEAR, tcpa_s=TCPA_MOST_S),)))
    (vessel,) = picture_of(decode_threat(encode_threat(far)), 0.7, -0.15, 5).vessels
    assert vessel.tcpa_s == TCPA_MOST_S


def test_a_difference_brings_a_threat_and_takes_it_away() -> None:
    calm = settle(replace(STATE, threat=None))
    begun = encode_delta(calm, 1, replace(calm, threat=THREAT))
    assert len(begun) == 10
    assert decode_delta(calm, begun).threat.role is Role.STAND_ON
    feared = settle(STATE)
    over = encode_delta(feared, 1, replace(feared, threat=None))
    assert len(over) == 4
    assert decode_delta(feared, over).threat is None


def test_the_shore_draws_her_where_she_is_from_the_boat() -> None:
    picture = picture_of(decode_threat(encode_threat(THREAT)), 0.7, -0.15, 5)
    (vessel,) = picture.vessels
    metres, bearing = inverse(0.7, -0.15, vessel.lat_rad, vessel.lon_rad)
    assert metres == pytest.approx(320.0, rel=0.031)
    assert bearing == pytest.approx(-1.2, abs=math.tau / 256)
    assert (vessel.danger, vessel.role) == (Danger.CLOSE, Role.STAND_ON)


def test_no_encoder_makes_the_eighth_role() -> None:
    with pytest.raises(BitsError):
        decode_threat(b"\x7f" + bytes(5))

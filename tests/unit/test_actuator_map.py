"""Logical outputs to pulses and back: the seed's numbers, trims, turned channels, and what is refused."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from companion.core.board.actuator_map import ActuatorConfig, ChannelConfig, pulses_to_demand, to_pulses
from mavlink_bridge.language.messages import ActuatorOutput


def output(port=0.0, starboard=0.0, rudder_port=0.0, rudder_starboard=0.0):
    return ActuatorOutput(0, port, starboard, rudder_port, rudder_starboard, "demand")


@pytest.mark.parametrize(("share", "pulse"), [(-1, 1000), (-0.5, 1250), (0, 1500), (0.1, 1550), (0.5, 1750), (1, 2000)])
@pytest.mark.parametrize("encoding", ["bipolar", "duty"])
def test_the_seeds_scale_in_either_encoding(share, pulse, encoding):
    config = ActuatorConfig(thruster_port=ChannelConfig(id="m", encoding=encoding))
    assert to_pulses(output(port=share), config, math.radians(30.0))[0] == pulse


@pytest.mark.parametrize("encoding", ["bipolar", "duty"])
def test_at_rest_every_pin_is_at_1500_not_1750(encoding):
    names = {"thruster_port": "m", "thruster_starboard": "M", "rudder_port": "l", "rudder_starboard": "L"}
    config = ActuatorConfig(**{name: ChannelConfig(id=wire_id, encoding=encoding) for name, wire_id in names.items()})
    assert to_pulses(output(), config, math.radians(30.0)) == (1500, 1500, 1500, 1500)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_stops(bad):
    assert to_pulses(output(bad, bad, bad, bad), ActuatorConfig(), math.radians(30.0)) == (1500, 1500, 1500, 1500)


@pytest.mark.parametrize("huge", [1.0001, 7.0, 1e300])
def test_limits_hold_before_rounding(huge):
    config = ActuatorConfig(lower_us=1100, upper_us=1900)
    assert to_pulses(output(huge, -huge, huge, -huge), config, math.radians(30.0)) == (1900, 1100, 1900, 1100)


def test_rudder_angles():
    config = ActuatorConfig()
    pulses = to_pulses(
        output(rudder_port=math.radians(15), rudder_starboard=math.radians(-30)), config, math.radians(30.0)
    )
    assert pulses == (1500, 1500, 1750, 1000)


def test_both_rudders_from_one_command():
    config = ActuatorConfig(rudders="together")
    assert to_pulses(output(rudder_port=math.radians(30)), config, math.radians(30.0))[2:] == (2000, 2000)


def test_trim_reverse_and_uneven_ends():
    config = ActuatorConfig(
        thruster_port=ChannelConfig(id="M", reverse=True),
        thruster_starboard=ChannelConfig(id="m", us_minus=1200, us_plus=1800, trim_us=10),
    )
    assert to_pulses(output(port=1.0, starboard=0.5), config, math.radians(30.0))[:2] == (1660, 1000)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"lower_us": 2000, "upper_us": 1000}, "never swapped"),
        ({"lower_us": 1500, "upper_us": 1500}, "must be below"),
        ({"thruster_port": {"id": "M"}}, "m and M"),
        ({"rudder_port": {"id": "m"}}, "l and L"),
        ({"thruster_port": {"id": "m", "us_minus": 2000, "us_plus": 1000}}, "reverse = true"),
        ({"thruster_port": {"id": "m", "us_zero": 1100}}, "board's own stop"),
        ({"thruster_port": {"id": "m", "trim_us": 60}}, "board's own stop"),
        ({"thruster_port": {"id": "m", "encoding": "duty"}, "upper_us": 1800}, "board's own stop"),
        ({"lower_us": 999}, "greater than or equal to 1000"),
        ({"terminator": ";"}, "Input should be"),
        ({"sketch": "mine"}, "Input should be"),
        ({"frequency_hz": 0.5}, "greater than or equal to 1"),
    ],
)
def test_refused_with_a_reason(keys, text):
    with pytest.raises(ValidationError, match=text):
        ActuatorConfig.model_validate(keys)


@pytest.mark.parametrize(
    ("sketch", "terminator"),
    [("", "\r\n"), ("parse-int", "\n"), ("read-line", "\n"), ("fixed-block", ""), ("next-byte", "\n")],
)
def test_the_sketch_picks_the_terminator(sketch, terminator):
    assert ActuatorConfig(sketch=sketch, terminator="\r\n").level0_terminator == terminator


def test_level_as_a_number_in_toml():
    assert ActuatorConfig.model_validate({"level": 1}).level == "1"


@pytest.mark.parametrize("pulse", [None, 0.0, 700.0, 2300.0])
def test_no_usable_pulse_stops(pulse):
    assert pulses_to_demand((pulse,) * 4, ActuatorConfig(), math.radians(30.0)) == (0.0, 0.0, 0.0, 0.0)


def test_neutral_keeps_the_rudder_trim():
    config = ActuatorConfig(rudder_port=ChannelConfig(id="l", trim_us=-40))
    assert to_pulses(output(), config, math.radians(30.0)) == (1500, 1500, 1460, 1500)

"""Battery and actuators as IMC tells them."""

from __future__ import annotations

import math
from typing import Final

from mavlink_bridge.imc import Current, FuelLevel, Outgoing, Rpm, SetServoPosition, SetThrusterActuation, Voltage

from .picture import ImcPicture

BATTERY: Final = "Battery"
PORT: Final = "Thruster Port"
STARBOARD: Final = "Thruster Starboard"
RUDDERS: Final = "Rudders"
_UNKNOWN_MV: Final = 0xFFFF
_NEUTRAL_US: Final = 1500
_SPAN_US: Final = 500
_LEAST_US: Final = 500
"""Shorter pulses are no pulses: 0 says that the board did not tell."""


def battery(picture: ImcPicture, now_us: int) -> list[Outgoing]:
    """Voltage, current and charge, each only when it is measured."""
    status = picture.fresh("SYS_STATUS", now_us)
    if status is None:
        return []
    found = []
    if status.voltage_battery != _UNKNOWN_MV:
        found.append(Outgoing(Voltage(status.voltage_battery * 0.001), label=BATTERY))
    if status.current_battery != -1:
        found.append(Outgoing(Current(status.current_battery * 0.01), label=BATTERY))
    if status.battery_remaining != -1:
        found.append(Outgoing(FuelLevel(float(status.battery_remaining), 100.0), label=BATTERY))
    return found


def actuation(picture: ImcPicture, now_us: int, rudder_full_rad: float) -> list[Outgoing]:
    """What the actuators were given, by the board's own word: thrusters -1...1, rudders in rad.

    Outputs 1 and 2 are the thrusters, 3 and 4 the rudders (docs/ACTUATORS.md).
    """
    raw = picture.fresh("SERVO_OUTPUT_RAW", now_us)
    if raw is None:
        return []
    thrusters = ((0, PORT, raw.servo1_raw), (1, STARBOARD, raw.servo2_raw))
    rudders = ((0, raw.servo3_raw), (1, raw.servo4_raw))
    found = [
        Outgoing(SetThrusterActuation(number, _share(pulse_us)), label=label)
        for number, label, pulse_us in thrusters
        if pulse_us >= _LEAST_US
    ]
    found += [
        Outgoing(SetServoPosition(number, _share(pulse_us) * rudder_full_rad), label=RUDDERS)
        for number, pulse_us in rudders
        if pulse_us >= _LEAST_US
    ]
    return found


def _share(pulse_us: int) -> float:
    return max(-1.0, min(1.0, (pulse_us - _NEUTRAL_US) / _SPAN_US))


def rpm(picture: ImcPicture, now_us: int) -> list[Outgoing]:
    """Revolutions, of vehicles that measure them."""
    esc, plain = picture.fresh("ESC_TELEMETRY_1_TO_4", now_us), picture.fresh("RPM", now_us)
    values = list(esc.rpm[:2]) if esc is not None else [plain.rpm1, plain.rpm2] if plain is not None else []
    pairs = zip((PORT, STARBOARD), values, strict=False)
    return [
        Outgoing(Rpm(max(-32768, min(round(value), 32767))), label=label)
        for label, value in pairs
        if math.isfinite(value)
    ]

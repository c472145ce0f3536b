"""From logical outputs to pulse widths: which wire carries what, and how many microseconds mean what.

One function owns each conversion: ``to_pulses`` the way out, ``pulses_to_demand`` the way back (the simulator's speed
controllers and servos). Inside, 0 is stopped and a rudder is an angle; the seed's 0...1 duty exists only here, as one
of two encodings, and both give the same stop pulse. Limits are applied in floating point, before anything is rounded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal, Self

from pydantic import Field, field_validator, model_validator

from mavlink_bridge.language.messages import ActuatorOutput
from mavlink_bridge.language.units import clamp

from ..config import Config, param
from .wire import IDS, Microseconds

STOP_US: Final = 1500
"""The pulse that the board itself applies when it stops the vessel."""
STOP_BAND_US: Final = 25
"""The board takes a thruster command this close to STOP_US for a stop (its interlock)."""
_LATE_MS: Final = 100.0
"""A command may come this much after its period: two ticks at 20 Hz, when a tick is late and a line is lost."""

_OUTPUTS: Final = ("thruster_port", "thruster_starboard", "rudder_port", "rudder_starboard")

SKETCHES: Final[dict[str, str]] = {"parse-int": "\n", "read-line": "\n", "fixed-block": "", "next-byte": "\n"}
"""Terminator for each common way in which level-0 sketches read commands (firmware-reliability §A.4)."""


class ChannelConfig(Config):
    """One servo output: its wire id and what its pulses mean."""

    id: Literal["m", "M", "l", "L"]
    """Letter on the wire: m, M thrusters 1, 2; l, L rudders 1, 2. Left out, it is the output's own."""
    encoding: Literal["bipolar", "duty"] = "bipolar"
    """bipolar: the three pulses below. duty: the seed's 0...1 with 0.5 at rest, from lower to upper bound."""
    us_minus: int = Field(1000, ge=1000, le=2000)
    """Pulse at full astern, or full rudder to port."""
    us_zero: int = Field(1500, ge=1000, le=2000)
    """Pulse at stop, or rudder amidships."""
    us_plus: int = Field(2000, ge=1000, le=2000)
    """Pulse at full ahead, or full rudder to starboard."""
    trim_us: int = Field(0, ge=-200, le=200)
    """Added to every pulse of this channel."""
    reverse: bool = False
    """Swap the two sides (a propeller of the other hand, a servo mounted the other way)."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if not self.us_minus < self.us_zero < self.us_plus:
            raise ValueError(
                f"us_minus {self.us_minus}, us_zero {self.us_zero}, us_plus {self.us_plus} must rise; "
                "to turn the direction round set reverse = true"
            )
        return self


class ActuatorConfig(Config):
    """The actuator board's protocol and its four channels (the seed's UART_Comm)."""

    level: Literal["auto", "0", "1"] = "auto"
    """auto: ask the board and wait for its answer; 1: and insist on its version; 0: the seed's unchecked letters. A board on level 0 does
    not stop if this computer dies; it arms only after `companion bench-actuators FILE --check`, in which a person saw it move."""
    sketch: Literal["", *SKETCHES] = ""  # type: ignore[valid-type]
    """How a level-0 sketch reads: parse-int, read-line, fixed-block or next-byte. Chooses the terminator."""
    terminator: Literal["\n", "", "\r\n", "\0"] = "\n"
    """What follows each level-0 command when no sketch is named."""
    batch: bool = True
    """Level 1: all four commands on one line, applied together. False: a line for each."""
    frequency_hz: float = param(
        20.0,
        "ACT_FREQ",
        "Rate at which all four commands are repeated; below 10 Hz steering lags and the board's silence limit is near",
        unit="Hz",
        ge=1,
        le=50,
        seed="UART_Comm: Message Frequency",
    )
    lower_us: int = param(
        1000,
        "ACT_LOWER",
        "No pulse below this",
        unit="us",
        ge=1000,
        le=2000,
        seed="UART_Comm: Actuation Lower Bound",
    )
    upper_us: int = param(
        2000,
        "ACT_UPPER",
        "No pulse above this",
        unit="us",
        ge=1000,
        le=2000,
        seed="UART_Comm: Actuation Upper Bound",
    )
    silence_ms: int = param(
        500,
        "ACT_SILENCE",
        "The board stops the thrusters after this time without a command",
        unit="ms",
        ge=200,
        le=2000,
    )
    rudders: Literal["apart", "together"] = "apart"
    """together: both servos follow the port rudder's command, as in the seed."""
    thruster_port: ChannelConfig = ChannelConfig(id="m")
    thruster_starboard: ChannelConfig = ChannelConfig(id="M")
    rudder_port: ChannelConfig = ChannelConfig(id="l")
    rudder_starboard: ChannelConfig = ChannelConfig(id="L")

    @model_validator(mode="before")
    @classmethod
    def _own_letters(cls, data: Any) -> Any:
        """An output of which only something else is said keeps its own letter."""
        if not isinstance(data, dict):
            return data
        said = {name: value for name, value in data.items() if name in _OUTPUTS and isinstance(value, dict)}
        return data | {name: {"id": cls.model_fields[name].default.id, **value} for name, value in said.items()}

    @field_validator("level", mode="before")
    @classmethod
    def _level_may_be_a_number(cls, value: object) -> object:
        return str(value) if type(value) is int else value

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.lower_us >= self.upper_us:
            raise ValueError(
                f"lower_us {self.lower_us} must be below upper_us {self.upper_us}; bounds are never swapped"
            )
        if {self.thruster_port.id, self.thruster_starboard.id} != {"m", "M"}:
            raise ValueError("the thrusters' ids must be m and M, one each: the board stops those when it must")
        if {self.rudder_port.id, self.rudder_starboard.id} != {"l", "L"}:
            raise ValueError("the rudders' ids must be l and L, one each")
        for name in ("thruster_port", "thruster_starboard"):
            stop = _Channel(getattr(self, name), self).pulse(0.0)
            if abs(stop - STOP_US) > STOP_BAND_US:
                raise ValueError(
                    f"{name} stops at {stop} us, but the board's own stop is {STOP_US}; keep it within "
                    f"{STOP_US - STOP_BAND_US} to {STOP_US + STOP_BAND_US} (us_zero, trim_us, lower_us, upper_us)"
                )
        return self

    @property
    def channels(self) -> tuple[ChannelConfig, ChannelConfig, ChannelConfig, ChannelConfig]:
        """In logical order: port thruster, starboard thruster, port rudder, starboard rudder."""
        return self.thruster_port, self.thruster_starboard, self.rudder_port, self.rudder_starboard

    @property
    def too_slow(self) -> bool:
        """Whether the board may fall silent between two commands: they go out on ticks, so one may come two of them late.

        A silent board on level 0 has no such limit that anybody knows.
        """
        return self.level != "0" and 1000.0 / self.frequency_hz + _LATE_MS > self.silence_ms

    @property
    def level0_terminator(self) -> str:
        return SKETCHES.get(self.sketch, self.terminator)


class PulseMap:
    """The conversions of one configuration, worked out beforehand: they run every tick and every physics step."""

    __slots__ = (
        "_asked",
        "_channels",
        "_demand",
        "_limit_rad",
        "_pins",
        "_seen",
        "_together",
        "_us",
        "config",
        "neutral_us",
    )

    def __init__(self, config: ActuatorConfig, rudder_max_rad: float) -> None:
        """``rudder_max_rad``: rudder angle at the servos' outer pulses, of the hull file."""
        self.config = config
        self._limit_rad = rudder_max_rad
        self._together = config.rudders == "together"
        self._channels = tuple(_Channel(channel, config) for channel in config.channels)
        self._pins = sorted(((c, i) for i, c in enumerate(self._channels)), key=lambda item: item[0].pin)
        """The channels in pin order, each with its place in logical order."""
        self._asked: tuple[float, ...] = ()
        self._seen: tuple[float | None, ...] = ()
        self._demand = (0.0, 0.0, 0.0, 0.0)
        self.neutral_us = self._us = self._pulses((0.0, 0.0, 0.0, 0.0))
        """Thrusters stopped and rudders amidships."""

    def pulses(self, output: ActuatorOutput) -> Microseconds:
        """Return the four pulse widths in pin order (m, M, l, L), µs, always within the configured bounds.

        What is not a finite number counts as stop or amidships.
        """
        port, starboard = output.rudder_port_rad, output.rudder_starboard_rad
        asked = (
            output.thruster_port,
            output.thruster_starboard,
            port / self._limit_rad,
            (port if self._together else starboard) / self._limit_rad,
        )
        if asked != self._asked:
            self._asked, self._us = asked, self._pulses(asked)
        return self._us

    def _pulses(self, shares: tuple[float, ...]) -> Microseconds:
        (first, i), (second, j), (third, k), (fourth, n) = self._pins
        return first.pulse(shares[i]), second.pulse(shares[j]), third.pulse(shares[k]), fourth.pulse(shares[n])

    def demand(self, pulses_us: Sequence[float | None]) -> tuple[float, float, float, float]:
        """Return (port thruster, starboard thruster, -1...1; port rudder, starboard rudder, rad) for pulses at the pins.

        The inverse of ``pulses``: a speed controller and a servo set up for this configuration. No pulse, or one that
        no servo takes (outside 800...2200 µs), stops a thruster and leaves a rudder amidships.
        """
        seen = tuple(pulses_us)
        if seen == self._seen:
            return self._demand
        self._seen = seen
        first, second, third, fourth = self._channels
        self._demand = (
            first.share(pulses_us[first.pin]),
            second.share(pulses_us[second.pin]),
            third.share(pulses_us[third.pin]) * self._limit_rad,
            fourth.share(pulses_us[fourth.pin]) * self._limit_rad,
        )
        return self._demand


class _Channel:
    """One output's straight lines: below zero, above zero, and the bounds."""

    __slots__ = ("_down", "_high", "_low", "_sign", "_up", "_zero", "pin")

    def __init__(self, channel: ChannelConfig, config: ActuatorConfig) -> None:
        minus, zero, plus = _ends(channel, config)
        self.pin = IDS.index(channel.id)
        self._zero, self._down, self._up = zero, zero - minus, plus - zero
        self._low, self._high = float(config.lower_us), float(config.upper_us)
        self._sign = -1.0 if channel.reverse else 1.0

    def pulse(self, share: float) -> int:
        if not -1.0 <= share <= 1.0:
            share = math.copysign(1.0, share) if math.isfinite(share) else 0.0
        share *= self._sign
        pulse = self._zero + share * (self._up if share >= 0.0 else self._down)
        if pulse < self._low:
            pulse = self._low
        elif pulse > self._high:
            pulse = self._high
        return round(pulse)

    def share(self, pulse_us: float | None) -> float:
        if pulse_us is None or not 800.0 <= pulse_us <= 2200.0:
            return 0.0
        offset = pulse_us - self._zero
        share = offset / (self._up if offset >= 0.0 else self._down)
        return clamp(share, -1.0, 1.0) * self._sign


def _ends(channel: ChannelConfig, config: ActuatorConfig) -> tuple[float, float, float]:
    """Pulses at -1, 0 and +1, before reverse; trim included."""
    if channel.encoding == "duty":
        low, high = float(config.lower_us), float(config.upper_us)
        ends = (low, low + 0.5 * (high - low), high)
    else:
        ends = (float(channel.us_minus), float(channel.us_zero), float(channel.us_plus))
    return ends[0] + channel.trim_us, ends[1] + channel.trim_us, ends[2] + channel.trim_us


def to_pulses(output: ActuatorOutput, config: ActuatorConfig, rudder_max_rad: float) -> Microseconds:
    """``PulseMap.pulses`` for one call."""
    return PulseMap(config, rudder_max_rad).pulses(output)


def pulses_to_demand(
    pulses_us: Sequence[float | None], config: ActuatorConfig, rudder_max_rad: float
) -> tuple[float, float, float, float]:
    """``PulseMap.demand`` for one call; who calls often keeps a ``PulseMap``."""
    return PulseMap(config, rudder_max_rad).demand(pulses_us)

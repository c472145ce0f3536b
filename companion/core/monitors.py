"""Monitors: from raw observations over time to the plain flags that the failsafe engine judges.

Each small class watches one thing for a stated time: thrust without speed, speed without thrust, drift while stopped,
oscillating actuators, the supply, the tick itself. Times are those of the fault matrix (firmware-reliability §C, rows 3, 35, 59,
62, 63).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Final

from pydantic import Field

from companion.core.config import Config, param
from mavlink_bridge.imc import ActuatorOutput, Desired, EstimatedState, SupplyVoltage
from mavlink_bridge.value import value

SpeedForThrust = Callable[[float], float]
"""Mean thrust, 0...1, to the steady speed in m/s that it should give."""

_TICK_WINDOW_US: Final = 10_000_000


class MonitorConfig(Config):
    """Thresholds of the monitors; 0 volts = that level is not judged."""

    battery_low_v: float = param(0.0, "BATT_LOW_VOLT", "Warn below (0 = off)", unit="V", ge=0, le=1000)
    battery_critical_v: float = param(0.0, "BATT_CRT_VOLT", "Return below (0 = off)", unit="V", ge=0, le=1000)
    battery_empty_v: float = param(0.0, "BATT_MIN_VOLT", "Stop below (0 = off)", unit="V", ge=0, le=1000)
    battery_filter_s: float = Field(5.0, gt=0, le=60)
    battery_stale_s: float = Field(5.0, gt=0, le=60)
    stuck_s: float = param(10.0, "STUCK_TIME", "Thrust without speed: warn after (0 = off)", unit="s", ge=0, le=600)
    stuck_share: float = Field(0.25, gt=0, le=1)
    """Stuck when slower than this share of what the thrust should give."""
    drift_mps: float = Field(0.3, gt=0, le=5)
    """Speed over ground in neutral that is worth a warning."""
    drift_s: float = Field(10.0, gt=0, le=600)
    drift_alarm_m: float = Field(5.0, gt=0, le=1000)
    """Drift since a failsafe stop at which the alarm is given; again at each doubling."""
    oscillation_reversals: int = Field(5, ge=3, le=50)
    oscillation_window_s: float = Field(3.0, gt=0, le=20)
    """A rudder or thruster loop that is unstable swings with about nine times its delay: 1.3 s."""
    oscillation_output: float = Field(0.5, gt=0, le=1)
    """Share of full output that a swing must reach on both sides."""
    late_s: float = Field(0.2, gt=0, le=5)
    very_late_s: float = Field(0.5, gt=0, le=5)
    jump_s: float = Field(1.0, gt=0, le=60)
    overrun_share: float = Field(0.05, gt=0, le=1)
    control_period_s: float = Field(0.05, gt=0, le=1)
    rudder_max_deg: float = Field(30.0, gt=0, le=90)
    """Full rudder, to weigh a rudder's swing."""


@value
class MonitorFlags:
    """What the monitors say in this tick; names as in the failsafe table's ``Flags``."""

    stuck: bool = False
    moving_in_neutral: bool = False
    drifting_while_stopped: bool = False
    oscillating: bool = False
    battery_low: bool = False
    battery_critical: bool = False
    battery_empty: bool = False
    battery_lost: bool = False
    time_jump: bool = False
    tick_late: bool = False
    tick_very_late: bool = False
    overruns: bool = False


class Held:
    """True once a condition has held without a break for a time."""

    def __init__(self) -> None:
        self._since_us: int | None = None

    def step(self, now_us: int, holds: bool, for_s: float) -> bool:
        if not holds:
            self._since_us = None
            return False
        if self._since_us is None:
            self._since_us = now_us
        return now_us - self._since_us >= round(for_s * 1e6)


class Reversals:
    """Counts swings of one channel from one side to the other, both beyond a share of full output."""

    def __init__(self) -> None:
        self._side = 0
        self._times_us: deque[int] = deque(maxlen=64)

    def step(self, now_us: int, value: float, config: MonitorConfig) -> bool:
        """``value``: -1...1. True when there were enough reversals within the window."""
        if not self._times_us and self._side == 0 and -config.oscillation_output <= value <= config.oscillation_output:
            return False
        if abs(value) > config.oscillation_output:
            side = 1 if value > 0.0 else -1
            if side == -self._side:
                self._times_us.append(now_us)
            self._side = side
        if not self._times_us:
            return False
        window_us = round(config.oscillation_window_s * 1e6)
        while self._times_us and now_us - self._times_us[0] > window_us:
            self._times_us.popleft()
        return len(self._times_us) >= config.oscillation_reversals


class Battery:
    """Filtered voltage against three levels, and the loss of the sensor."""

    def __init__(self) -> None:
        self._volts: float | None = None
        self._seen_us: int | None = None

    def step(self, now_us: int, supply: SupplyVoltage | None, config: MonitorConfig) -> tuple[bool, bool, bool, bool]:
        """Return (low, critical, empty, lost)."""
        volts = None if supply is None else supply.voltage_v
        if supply is not None and volts is not None and math.isfinite(volts) and supply.t_us != self._seen_us:
            self._filter(supply.t_us, volts, config.battery_filter_s)
        lost = self._seen_us is not None and now_us - self._seen_us > round(config.battery_stale_s * 1e6)
        if self._volts is None:
            return False, False, False, False
        low, critical, empty = (
            self._volts < level for level in (config.battery_low_v, config.battery_critical_v, config.battery_empty_v)
        )
        return low, critical, empty, lost

    def _filter(self, t_us: int, volts: float, time_constant_s: float) -> None:
        if self._volts is None or self._seen_us is None:
            self._volts = volts
        else:
            dt_s = max(t_us - self._seen_us, 0) / 1e6
            self._volts += (volts - self._volts) * (1.0 - math.exp(-dt_s / time_constant_s))
        self._seen_us = t_us


class Ticks:
    """Lateness of the control tick: single, repeated, and the machine having stood still."""

    def __init__(self) -> None:
        self._last_us: int | None = None
        self._late_us: deque[int] = deque(maxlen=512)

    def step(self, now_us: int, late_s: float, config: MonitorConfig) -> tuple[bool, bool, bool, bool]:
        """Return (jump, late, very late, overruns)."""
        gap_s = 0.0 if self._last_us is None else (now_us - self._last_us) / 1e6
        self._last_us = now_us
        jump = gap_s > config.jump_s or gap_s < 0.0
        if late_s > config.control_period_s:
            self._late_us.append(now_us)
        while self._late_us and now_us - self._late_us[0] > _TICK_WINDOW_US:
            self._late_us.popleft()
        allowed = config.overrun_share * _TICK_WINDOW_US / 1e6 / config.control_period_s
        return jump, late_s > config.late_s, late_s > config.very_late_s, len(self._late_us) > allowed


class Drift:
    """How far the vessel has drifted since a failsafe stopped it."""

    def __init__(self) -> None:
        self._anchor: tuple[float, float] | None = None

    def step(self, state: EstimatedState, stopped: bool, alarm_m: float) -> bool:
        if not stopped:
            self._anchor = None
            return False
        if state.x_m is None or state.y_m is None:
            return False
        if self._anchor is None:
            self._anchor = (state.x_m, state.y_m)
        return math.hypot(state.x_m - self._anchor[0], state.y_m - self._anchor[1]) > alarm_m


class Monitors:
    """All of them together; one call per tick."""

    def __init__(self, config: MonitorConfig) -> None:
        self._config = config
        self._stuck, self._adrift = Held(), Held()
        self._swings = (Reversals(), Reversals(), Reversals(), Reversals())
        self._battery, self._ticks, self._drift = Battery(), Ticks(), Drift()

    def configure(self, config: MonitorConfig) -> None:
        """Take new thresholds; running times go on."""
        self._config = config

    def step(
        self,
        now_us: int,
        state: EstimatedState,
        output: ActuatorOutput,
        desired: Desired | None,
        stopped: bool,
        late_s: float,
        supply: SupplyVoltage | None,
        vessel_speed_fn: SpeedForThrust,
    ) -> MonitorFlags:
        """``output``: what was sent last. ``stopped``: a failsafe holds the vessel in neutral. ``late_s``: of this tick."""
        config = self._config
        low, critical, empty, lost = self._battery.step(now_us, supply, config)
        jump, late, very_late, overruns = self._ticks.step(now_us, late_s, config)
        thrust = 0.5 * (output.thruster_port + output.thruster_starboard)
        neutral = output.thruster_port == 0.0 and output.thruster_starboard == 0.0
        speed_mps = state.sog_mps
        no_way = speed_mps is not None and thrust > 0.0 and self._no_way(speed_mps, thrust, desired, vessel_speed_fn)
        adrift = speed_mps is not None and neutral and speed_mps > config.drift_mps
        return MonitorFlags(
            stuck=self._stuck.step(now_us, no_way and config.stuck_s > 0.0, config.stuck_s),
            moving_in_neutral=self._adrift.step(now_us, adrift, config.drift_s),
            drifting_while_stopped=self._drift.step(state, stopped, config.drift_alarm_m),
            oscillating=self._oscillates(now_us, output),
            battery_low=low,
            battery_critical=critical,
            battery_empty=empty,
            battery_lost=lost,
            time_jump=jump,
            tick_late=late,
            tick_very_late=very_late,
            overruns=overruns,
        )

    def _no_way(
        self, speed_mps: float, thrust: float, desired: Desired | None, vessel_speed_fn: SpeedForThrust
    ) -> bool:
        # A vessel that keeps station stems the stream: thrust without speed over ground is its task, not a fault.
        if desired is not None and desired.speed_mps is not None and abs(desired.speed_mps) < self._config.drift_mps:
            return False
        return speed_mps < self._config.stuck_share * vessel_speed_fn(thrust)

    def _oscillates(self, now_us: int, output: ActuatorOutput) -> bool:
        full_rad = math.radians(self._config.rudder_max_deg)
        shares = (
            output.thruster_port,
            output.thruster_starboard,
            output.rudder_port_rad / full_rad,
            output.rudder_starboard_rad / full_rad,
        )
        swinging = [swing.step(now_us, share, self._config) for swing, share in zip(self._swings, shares, strict=True)]
        return any(swinging)

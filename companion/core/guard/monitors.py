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

from mavlink_bridge.language.messages import ActuatorOutput, Desired, EstimatedState, Severity, SupplyVoltage
from mavlink_bridge.language.value import value

from ..config import Config, param

SpeedForThrust = Callable[[float], float]
"""Mean thrust, 0...1, to the steady speed in m/s that it should give."""

_TICK_WINDOW_US: Final = 10_000_000
"""Late ticks are counted over 10 s (fault matrix, row 63)."""
_STILL_MPS: Final = 0.2
"""Hardly creeping, yet well above a receiver's noise of some 0.03 m/s. A stream that just equals the vessel's best speed looks
the same as dead thrust, and is as hopeless."""
_CALMED: Final = 0.5
"""Share of the speed that is worth a warning below which a boat in neutral has come to rest: wind and current that carry her waver by a
third, and she was told of as moving and as over it eleven times in six minutes."""
_NO_DRIFT: Final = 0.5
"""Share of the alarm's distance within which a boat has come back to her place: a receiver without corrections wanders by metres."""
_FORGOTTEN_US: Final = 600_000_000
"""Two oscillations so far apart have nothing to do with each other."""
_LONGEST_US: Final = 120_000_000
"""A boat without thrust for longer is lost in a current; one that swings for three seconds in two minutes is not."""


class MonitorConfig(Config):
    """Thresholds of the monitors; 0 volts = that level is not judged."""

    battery_low_v: float = param(0.0, "BATT_LOW_VOLT", "Warn below (0 = off)", unit="V", ge=0, le=1000)
    battery_critical_v: float = param(0.0, "BATT_CRT_VOLT", "Return below (0 = off)", unit="V", ge=0, le=1000)
    battery_empty_v: float = param(0.0, "BATT_MIN_VOLT", "Stop below (0 = off)", unit="V", ge=0, le=1000)
    battery_filter_s: float = Field(5.0, gt=0, le=60)
    """Time constant of the voltage that is judged: a start of the thrusters must not count."""
    battery_stale_s: float = Field(5.0, gt=0, le=60)
    """A board that has given voltages and gives none for this long has lost its sensor."""
    stuck_s: float = param(10.0, "STUCK_TIME", "Thrust without speed: warn after (0 = off)", unit="s", ge=0, le=600)
    stuck_share: float = Field(0.25, gt=0, le=1)
    """Stuck when slower than this share of what the thrust should give, and than `drift_mps`."""
    drift_mps: float = Field(0.3, gt=0, le=5)
    """Speed over ground in neutral that is worth a warning, until she lies below half of it; what makes as much is not stuck."""
    drift_s: float = Field(10.0, gt=0, le=600)
    """So long in neutral before moving is warned of, and so long nearly still before it is over."""
    drift_alarm_m: float = Field(5.0, gt=0, le=1000)
    """Drift since a failsafe stop at which the alarm is given; again at each doubling."""
    oscillation_reversals: int = Field(5, ge=3, le=50)
    """So many swings from one side to the other within the window are an oscillation."""
    oscillation_window_s: float = Field(3.0, gt=0, le=20)
    """A rudder or thruster loop that is unstable swings with about nine times its delay: 1.3 s."""
    oscillation_output: float = Field(0.5, gt=0, le=1)
    """Share of full output that a swing must reach on both sides."""
    oscillation_hold_s: float = Field(15.0, ge=0, le=600)
    """So long the thrust stays cut after the last swing; twice as long each time it comes again within ten minutes, two minutes at most."""
    late_s: float = Field(0.2, gt=0, le=5)
    """A tick that comes so late is warned of."""
    very_late_s: float = Field(0.5, gt=0, le=5)
    """One that comes so late stops the vessel."""
    jump_s: float = Field(1.0, gt=0, le=60)
    """A gap between two ticks beyond this means that the computer stood still, and disarms."""
    overrun_share: float = Field(0.05, gt=0, le=1)
    """More late ticks than this share of ten seconds' are an overload."""


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
    drifted_m: float = 0.0
    """The distance at which the alarm of a drift was given last: it is given again at each doubling."""

    def told_since(self, before: MonitorFlags) -> list[tuple[Severity, str]]:
        """What is to be told beside the failsafe table's own texts; ``before``: what the monitors said in the tick before."""
        if 0.0 < before.drifted_m < self.drifted_m:
            return [(Severity.ALERT, f"Drifted {self.drifted_m:.0f} m since the failsafe's stop")]
        return []


class Held:
    """True once a condition has held without a break for a time."""

    def __init__(self) -> None:
        self._since_us: int | None = None

    def step(self, now_us: int, holds: bool, for_us: int) -> bool:
        if not holds:
            self._since_us = None
            return False
        if self._since_us is None:
            self._since_us = now_us
        return now_us - self._since_us >= for_us


class Adrift:
    """Moving in neutral: told after a time, and over only when she has lain nearly still for as long; a speed unknown changes nothing."""

    def __init__(self) -> None:
        self._fast, self._still = Held(), Held()
        self._told = False

    def step(self, now_us: int, neutral: bool, speed_mps: float | None, *, bound_mps: float, for_us: int) -> bool:
        made_mps = speed_mps if neutral else None
        fast = self._fast.step(now_us, made_mps is not None and made_mps > bound_mps, for_us)
        still = self._still.step(now_us, made_mps is not None and made_mps < _CALMED * bound_mps, for_us)
        self._told = neutral and (fast or (self._told and not still))
        return self._told


class Reversals:
    """Counts swings of one channel from one side to the other, both beyond a share of full output."""

    def __init__(self) -> None:
        self._side = 0
        self.times_us: deque[int] = deque(maxlen=64)
        """When it swung over, lately."""

    def configure(self, config: MonitorConfig) -> None:
        self._bound, self._enough = config.oscillation_output, config.oscillation_reversals
        self._window_us = round(config.oscillation_window_s * 1e6)

    def step(self, now_us: int, value: float) -> bool:
        """``value``: -1...1. True when there were enough reversals within the window."""
        times_us, bound = self.times_us, self._bound
        if value > bound or value < -bound:
            side = 1 if value > bound else -1
            if side == -self._side:
                times_us.append(now_us)
            self._side = side
        if not times_us:
            return False
        while times_us and now_us - times_us[0] > self._window_us:
            times_us.popleft()
        return len(times_us) >= self._enough


class Steadying:
    """How long an oscillation is taken to last: a loop that is unstable swings again at once, and waits longer each time.

    In a blow a sound one may swing so for some seconds, too: the boat that was cut for good was carried away.
    """

    def __init__(self) -> None:
        self._until_us: int | None = None
        self._hold_us = 0

    def step(self, now_us: int, swings: bool, hold_us: int) -> bool:
        """``swings``: an oscillation is found in this tick. True from then on until it has been quiet for long enough."""
        until_us = self._until_us
        if swings:
            if until_us is None or now_us > until_us + _FORGOTTEN_US:
                self._hold_us = hold_us
            elif now_us >= until_us:
                self._hold_us = max(hold_us, min(2 * self._hold_us, _LONGEST_US))
            self._until_us = until_us = now_us + self._hold_us
        return until_us is not None and (swings or now_us < until_us)


class Battery:
    """Filtered voltage against three levels, and the loss of the sensor."""

    def __init__(self) -> None:
        self._volts: float | None = None
        self._seen_us: int | None = None

    def configure(self, config: MonitorConfig) -> None:
        self._low_v, self._critical_v, self._empty_v = (
            config.battery_low_v,
            config.battery_critical_v,
            config.battery_empty_v,
        )
        self._filter_s, self._stale_us = config.battery_filter_s, round(config.battery_stale_s * 1e6)

    def step(self, now_us: int, supply: SupplyVoltage | None) -> tuple[bool, bool, bool, bool]:
        """Return (low, critical, empty, lost)."""
        if supply is not None and supply.t_us != self._seen_us:
            volts = supply.voltage_v
            if volts is not None and math.isfinite(volts):
                self._take(supply.t_us, volts)
        volts = self._volts
        if volts is None or self._seen_us is None:
            return False, False, False, False
        lost = now_us - self._seen_us > self._stale_us
        return volts < self._low_v, volts < self._critical_v, volts < self._empty_v, lost

    def _take(self, t_us: int, volts: float) -> None:
        if self._volts is None or self._seen_us is None:
            self._volts = volts
        else:
            dt_s = max(t_us - self._seen_us, 0) / 1e6
            self._volts += (volts - self._volts) * (1.0 - math.exp(-dt_s / self._filter_s))
        self._seen_us = t_us


class Ticks:
    """Lateness of the control tick: single, repeated, and the machine having stood still."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last_us: int | None = None
        self._late_us: deque[int] = deque(maxlen=512)

    def configure(self, config: MonitorConfig) -> None:
        self._late_s, self._very_late_s = config.late_s, config.very_late_s
        self._jump_s = config.jump_s
        self._allowed = config.overrun_share * _TICK_WINDOW_US / 1e6 / self._period_s

    def step(self, now_us: int, late_s: float) -> tuple[bool, bool, bool, bool]:
        """Return (jump, late, very late, overruns)."""
        gap_s = 0.0 if self._last_us is None else (now_us - self._last_us) / 1e6
        self._last_us = now_us
        jump = gap_s > self._jump_s or gap_s < 0.0
        times_us = self._late_us
        if late_s > self._period_s:
            times_us.append(now_us)
        elif not times_us:
            return jump, late_s > self._late_s, late_s > self._very_late_s, False
        while times_us and now_us - times_us[0] > _TICK_WINDOW_US:
            times_us.popleft()
        return jump, late_s > self._late_s, late_s > self._very_late_s, len(times_us) > self._allowed


class Drift:
    """How far the vessel has drifted since a failsafe stopped it; what only the position has leapt by is no drift."""

    def __init__(self) -> None:
        self._anchor: tuple[float, float] | None = None
        self._alarmed_m = 0.0

    def step(self, state: EstimatedState, stopped: bool, alarm_m: float, leapt_m: tuple[float, float]) -> float:
        """Return the distance of the last alarm: ``alarm_m``, twice that, four times that...; 0 = none, or she is back."""
        if not stopped:
            self._anchor, self._alarmed_m = None, 0.0
            return 0.0
        if state.x_m is None or state.y_m is None:
            return self._alarmed_m
        north_m, east_m = state.x_m - leapt_m[0], state.y_m - leapt_m[1]
        if self._anchor is None:
            self._anchor = (north_m, east_m)
        drifted_m = math.hypot(north_m - self._anchor[0], east_m - self._anchor[1])
        if drifted_m < _NO_DRIFT * alarm_m:
            self._alarmed_m = 0.0
        while drifted_m > (next_m := 2.0 * self._alarmed_m or alarm_m):
            self._alarmed_m = next_m
        return self._alarmed_m


class Monitors:
    """All of them together; one call per tick."""

    def __init__(self, config: MonitorConfig, rudder_max_rad: float, period_us: int) -> None:
        """``rudder_max_rad``: full rudder of the hull, to weigh a rudder's swing. ``period_us``: of the tick."""
        self._full_rad, self.period_us = rudder_max_rad, period_us
        self._stuck, self._adrift = Held(), Adrift()
        self._swings = (Reversals(), Reversals(), Reversals(), Reversals())
        self._steadying = Steadying()
        self._battery, self._ticks, self._drift = Battery(), Ticks(period_us / 1e6), Drift()
        self._said: tuple[tuple[bool, ...], float] = (), 0.0
        self._flags = MonitorFlags()
        self.configure(config)

    def configure(self, config: MonitorConfig) -> None:
        """Take new thresholds; running times go on."""
        self._stuck_us, self._stuck_share = round(config.stuck_s * 1e6), config.stuck_share
        self._watch_way = config.stuck_s > 0.0
        self._drift_mps, self._drift_us = config.drift_mps, round(config.drift_s * 1e6)
        self._alarm_m = config.drift_alarm_m
        self._bound, self._hold_us = config.oscillation_output, round(config.oscillation_hold_s * 1e6)
        self._shares: tuple[float, ...] = ()
        self._at_rest = False
        """No actuator has swung over lately: as long as none moves, none does."""
        for part in (*self._swings, self._battery, self._ticks):
            part.configure(config)

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
        leapt_m: tuple[float, float] = (0.0, 0.0),
    ) -> MonitorFlags:
        """``output``: what was sent last. ``stopped``: a failsafe holds the vessel in neutral. ``late_s``: of this tick.

        ``leapt_m``: by how much the position has leapt in all, north and east.
        """
        no_way = False
        speed_mps, port, starboard = state.sog_mps, output.thruster_port, output.thruster_starboard
        if speed_mps is not None:
            no_way = self._watch_way and self._no_way(speed_mps, 0.5 * (port + starboard), desired, vessel_speed_fn)
        drifted_m = self._drift.step(state, stopped, self._alarm_m, leapt_m)
        neutral, bound_mps, drift_us = port == 0.0 and starboard == 0.0, self._drift_mps, self._drift_us
        said = (
            self._stuck.step(now_us, no_way, self._stuck_us),
            self._adrift.step(now_us, neutral, speed_mps, bound_mps=bound_mps, for_us=drift_us),
            drifted_m > 0.0,
            self._steadying.step(now_us, self._oscillates(now_us, output), self._hold_us),
            *self._battery.step(now_us, supply),
            *self._ticks.step(now_us, late_s),
        )
        if (said, drifted_m) != self._said:
            self._said, self._flags = (said, drifted_m), MonitorFlags(*said, drifted_m=drifted_m)
        return self._flags

    def _no_way(
        self, speed_mps: float, thrust: float, desired: Desired | None, vessel_speed_fn: SpeedForThrust
    ) -> bool:
        if thrust <= 0.0:
            return False
        slow_mps = self._drift_mps
        if desired is not None and desired.speed_mps is not None and abs(desired.speed_mps) < slow_mps:
            # A vessel that keeps station stems the stream: thrust without speed over ground is its task, not a fault.
            if desired.asked_mps is None or abs(desired.asked_mps) < slow_mps:
                return False
            slow_mps = _STILL_MPS
        # Nor is one stuck that makes way slowly: against a stream that is all it can do, and a stop would lose what it has.
        return speed_mps < slow_mps and speed_mps < self._stuck_share * vessel_speed_fn(thrust)

    def _oscillates(self, now_us: int, output: ActuatorOutput) -> bool:
        shares = (
            output.thruster_port,
            output.thruster_starboard,
            output.rudder_port_rad / self._full_rad,
            output.rudder_starboard_rad / self._full_rad,
        )
        if shares == self._shares and self._at_rest:
            return False
        self._shares, self._at_rest, found = shares, True, False
        bound, swings = self._bound, self._swings
        for k, share in enumerate(shares):
            if share > bound or share < -bound or swings[k].times_us:
                found |= swings[k].step(now_us, share)
                self._at_rest &= not swings[k].times_us
        return found

"""The minimum-altitude guard (the seed's MinAltitude): keeps enough water under the keel, and says what it does.

Parity part: states unknown, ok, correction, locked by the table of vessel-control §5.2 with architecture-study §4.8's
*unknown* row; thresholds A-m, A, A+g; one Abort per entry and one per forbidden activation. Beyond parity: a limit that
grows with the closing rate, and the map ahead (``lookahead.py``). *Altitude* is the water under the keel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Final

from mavlink_bridge.language.messages import Distance, EstimatedState, GuardState, Severity
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.value import value

from ...hull.geometry import HullGeometry
from ...hull.stopping import Braking
from .ahead import DepthAhead, DepthLook
from .config import DepthGuardConfig
from .evidence import CORRECTION, EPS_M, LOCKED, OK, UNKNOWN, LockEvidence, next_state
from .grid import DepthGrid, PlanLeg, PlanProblem, check_plan, unknown_share
from .input import DepthInput
from .lookahead import PathAhead, StoppingDistance
from .memory import DepthMemory
from .pace import SounderPace
from .shoal import AT_SEA, BLIND, Going, MetShoal
from .ways import headway_mps

__all__ = ["DepthFlags", "DepthGuard", "DepthGuardConfig", "GuardOutput", "next_state"]

_UNKNOWN_AFTER_S: Final = 5.0
"""A sounder may lose the bottom for as long under bubbles and in weed."""
_SEEN_LATE_S: Final = 0.1
"""A boat that is being braked has lost this much of her time when her speed is told, beside the fix's age: the velocity filter, the line to
the board, and a tick. Let go by what is told, she went astern with 0.5 m/s and more."""
_BRAKE_REST_US: Final = 5_000_000
"""Between two brakings, so that a sounder that errs cannot keep the vessel going astern."""
_BACK_M: Final = 10.0
"""So far along its path a correction shows whether it leads back: beyond the turn of every shipped hull."""
_FAR_MARGINS: Final = 3.0
"""So many margins below the least altitude three readings lock at once, whatever their noise."""
_START_S: Final = 3.0
"""A sounder may take so long to speak, and the filter to fill, before it is called lost."""


@value
class DepthFlags:
    """Of the water under the keel; names as in the failsafe table."""

    depth_shallow: bool = False
    """Correction was entered below the least altitude, and the altitude has not been good since."""
    depth_locked: bool = False
    depth_ahead: bool = False
    """Look-ahead says stop (the state may still be ok)."""
    depth_braking: bool = False
    """Lose way with astern thrust now; the stop follows when the way is off."""
    depth_lost: bool = False
    """The altitude is unknown, it was not lost in deep water, and the policy is not ``ignore``."""
    depth_blind: bool = False
    """Lost for longer than the policy ``stop`` or ``required`` allows."""


@value
class GuardOutput:
    """One tick of the guard."""

    state: GuardState
    altitude_m: float | None
    """Filtered, used for the state."""
    altitude_raw_m: float | None
    limit_m: float | None
    """What the altitude is held against now: the least altitude plus what stopping needs."""
    least_m: float | None = None
    """The least altitude itself, which the texts name."""
    abort: bool = False
    """Stop everything, now: an entry into correction or locked, or a forbidden activation."""
    slow_to_mps: float | None = None
    neutral: bool = False
    """No thrust for now: whether the altitude is below the lock is being found out."""
    back_rad: float | None = None
    """Back out with the bow held there, before what is ordered is sailed; None = sail it."""
    flags: DepthFlags = field(default_factory=DepthFlags)
    closing_mps: float = 0.0
    """How fast the bottom closes, as far as proven."""
    map_least_m: float | None = None
    """Least altitude that the map shows along the way to come."""
    texts: tuple[tuple[Severity, str], ...] = field(default=())


class DepthGuard:
    """Holds the input chain and the state. Call ``measure`` for each reading and ``step`` each tick."""

    def __init__(self, config: DepthGuardConfig, geometry: HullGeometry) -> None:
        self.state = UNKNOWN
        self.input = DepthInput(config.input, geometry)
        self._evidence = LockEvidence()
        self._keel_m = geometry.keel_m
        self._shallow = self._unlocked = self._refused = False
        self._started_us: int | None = None
        self._brake_from_us, self._brake_until_us = 0, -_BRAKE_REST_US
        self._doubts: bool
        """In this step: a correction closes in its turn, and its soundings may mean a lock: neutral until they prove it or not."""
        self.memory = DepthMemory(config.memory, config.input.sigma_m) if config.memory.enabled else None
        """What has been sounded, now and on earlier voyages."""
        self.utc_s = 0
        """The time that soundings are remembered with, seconds since 1970; 0 = unknown. Whoever knows it sets it."""
        self._shoal = MetShoal()
        self._ahead = self.input.bottom = DepthAhead(config, self.memory, geometry)
        self._pace = SounderPace()
        self._trouble = ""
        """What was told of the sounder last."""
        self.configure(config)

    def configure(self, config: DepthGuardConfig) -> None:
        """Take new settings; the next ``step`` re-evaluates with them."""
        self._config = config
        self._enabled, self._brakes_astern = config.enabled, config.brake
        self._min_m, self._good_margin_m = config.min_altitude_m, config.good_margin_m
        self._minimum_margin_m = config.minimum_margin_m
        self._datum_offset_m = config.datum_offset_m(self._keel_m)
        self._slows_when_lost = config.unknown_policy == "slow"
        self._shoal.configure(config)
        self.input.configure(config.input)
        self._ahead.configure(config)

    def measure(self, distance: Distance, state: EstimatedState | None, source: int | None = 0) -> None:
        """Take one echo-sounder reading of the sensor link ``source``; None: it came over MAVLink."""
        self._ahead.utc_s = self.utc_s
        passed = self.input.measure(distance, state, source)
        self._pace.note(passed)
        self._ahead.note(passed, 0.0 if state is None else state.sog_mps or 0.0)
        self._evidence.note(passed)
        if self.memory is not None and state is not None:
            for reading in passed:
                depth_m = reading.value_m - self._datum_offset_m
                self.memory.note(state, reading.t_us, depth_m, self.utc_s)

    def set_map(self, grid: DepthGrid | None) -> None:
        """Use a depth map for the way ahead and for plans; None = none."""
        self._ahead.map = grid

    def check_plan(self, legs: Sequence[PlanLeg]) -> PlanProblem | None:
        """Hold a plan against the map; the first item that would have too little water, or None."""
        grid, config = self._ahead.map, self._config
        if grid is None or not config.enabled:
            return None
        return check_plan(grid, legs, config.min_altitude_m - config.map_offset_m(self._keel_m))

    def unknown_share(self, legs: Sequence[PlanLeg]) -> float | None:
        """Share of a plan's way on which the map knows no depth, 0...1; None without a map."""
        return None if self._ahead.map is None or not self._config.enabled else unknown_share(self._ahead.map, legs)

    def unlock_once(self) -> None:
        """An operator on the spot lifts the lock until the altitude has been good again."""
        self._unlocked = True

    def forget(self, lat_rad: float, lon_rad: float, radius_m: float) -> tuple[int, float | None]:
        """Forget own soundings around a place; return how many cells, and their least depth below datum, m."""
        return (0, None) if self.memory is None else self.memory.forget_near(lat_rad, lon_rad, radius_m)

    def activation(self, now_us: int) -> str | None:
        """A loop is about to be activated: return why not (and send one Abort at the next step), or None."""
        reason = self.refusal(now_us)
        if reason is not None:
            self._refused = True
        return reason

    def refusal(self, now_us: int) -> str | None:
        """Return why motion is not allowed now, or None. Asking changes nothing."""
        if not self._config.enabled:
            return None
        altitude_m = self.input.altitude_m(now_us)
        if self.state is LOCKED and not self._unlocked:
            shown = "unknown" if altitude_m is None else f"{altitude_m:.2f} m"
            good_m = self._config.min_altitude_m + self._config.good_margin_m
            return f"depth guard locked: altitude {shown}, needs {good_m:.2f} m"
        if self._config.required and altitude_m is None:
            return "water depth unknown, and depth.required is set"
        return None

    def step(
        self,
        now_us: int,
        state: EstimatedState | None,
        loops_active: bool,
        path_ahead: PathAhead | None = None,
        stopping_distance_fn: StoppingDistance | None = None,
        *,
        braking: Braking | None = None,
        going: Going = AT_SEA,
    ) -> GuardOutput:
        """Evaluate the guard for this tick.

        ``path_ahead``: gives the path that is being sailed; None = straight on. ``stopping_distance_fn``: by coasting.
        ``going``: what else she is about. ``braking``: what thrust astern does where ``brake`` is set; None = nothing brakes.
        """
        if self._started_us is None:
            self._started_us = now_us
        altitude_m = self.input.altitude_m(now_us)
        if not self._enabled:
            self.state, self._shallow = UNKNOWN, False
            return GuardOutput(UNKNOWN, altitude_m, self.input.raw_m, None)
        texts = [*self._told_of_pace(), *self._told_of_sounder(altitude_m)]
        self._doubts = False
        entered = self._advance(altitude_m, texts, loops_active, self._ahead.leads_back(state, path_ahead, _BACK_M))
        abort = (loops_active and entered) or self._refused
        self._refused = False
        lost_s = None if altitude_m is not None else self._lost_for_s(now_us)
        self._ahead.correcting = self.state is CORRECTION
        way_fn = self._way_fn(now_us, stopping_distance_fn, braking)
        ahead = self._ahead.look(
            now_us, state, altitude_m, source=self.input, path_ahead=path_ahead, stopping_distance_fn=way_fn
        )
        is_measured, is_good = ahead.stop, None if altitude_m is None else self.state is OK
        ahead, told = self._shoal.look(ahead, state, path_ahead, stopping_distance_fn, is_good=is_good)
        texts += told
        is_braked = now_us < self._brake_until_us + _BRAKE_REST_US
        # A stop that begins with the brake ends in neutral: what holds a place meanwhile is nobody's order.
        going = AT_SEA if is_braked else going
        judged = self._shoal.judge(state, path_ahead, going, stop=loops_active and ahead.stop, by_place=ahead.by_place)
        stop_ahead = judged.stop
        if loops_active and (entered or (stop_ahead and is_measured)):
            self._shoal.meet(state, altitude_m, ahead, self._ahead.slope(now_us))
        texts += self._ahead.told(stop_ahead, ahead, state, now_us=now_us, goes_on=is_braked)
        brake = self._brakes(now_us, state, braking if loops_active else None, begins=entered or stop_ahead)
        return GuardOutput(
            state=self.state,
            altitude_m=altitude_m,
            altitude_raw_m=self.input.raw_m,
            limit_m=ahead.limit_m,
            least_m=self._min_m,
            abort=abort,
            slow_to_mps=self._slow_to_mps(ahead, is_lost=lost_s is not None),
            neutral=self._doubts,
            back_rad=judged.back_rad,
            flags=self._flags(lost_s, stop=stop_ahead, brake=brake),
            closing_mps=ahead.closing_mps,
            map_least_m=ahead.map_least_m,
            texts=tuple(texts),
        )

    def _flags(self, lost_s: float | None, *, stop: bool, brake: bool) -> DepthFlags:
        return DepthFlags(
            depth_shallow=self._shallow and not brake,
            depth_locked=self.state is LOCKED and not self._unlocked and not brake,
            depth_ahead=stop and not brake,
            depth_braking=brake,
            depth_lost=lost_s is not None,
            depth_blind=lost_s is not None and lost_s >= _UNKNOWN_AFTER_S and self._stops_when_unknown(),
        )

    def blind_refusal(self, now_us: int, state: EstimatedState, target: NorthEast) -> str:
        """Why a target is not sailed to: the way there leads over a shoal that nobody sees now; or "". Going slow is let through."""
        is_seen = self.input.altitude_m(now_us) is not None
        if is_seen or not self._shoal.minds_silence or self._slows_when_lost:
            return ""
        return BLIND if self._shoal.bars(state, target) else ""

    def _slow_to_mps(self, ahead: DepthLook, *, is_lost: bool) -> float | None:
        """The speed that is left to the vessel; None = any."""
        return self._config.unknown_speed_mps if is_lost and self._slows_when_lost else ahead.slow_to_mps

    def startup_warning(self, coasting_fn: StoppingDistance, braking: Braking | None = None) -> str:
        """Say on which slopes the margins allow a correction at all (vessel-control §5.4)."""
        config = self._config
        stopping_distance_fn = coasting_fn if braking is None or not config.brake else braking.way_m
        parts = []
        for speed_mps in (1.5, 2.5):
            run_m = stopping_distance_fn(speed_mps) + 0.5 * speed_mps
            parts.append(f"{100.0 * config.minimum_margin_m / run_m:.1f} % at {speed_mps:g} m/s")
        return f"Depth margin {config.minimum_margin_m:g} m: correction only on slopes below {', '.join(parts)}"

    def _advance(
        self, altitude_m: float | None, texts: list[tuple[Severity, str]], loops_active: bool, leads_back: bool
    ) -> bool:
        """Move the state; return True when this is an entry that aborts."""
        old, min_m = self.state, self._min_m
        new = next_state(old, altitude_m, min_m, self._minimum_margin_m, self._good_margin_m)
        if new is LOCKED and old is CORRECTION and self._waits(altitude_m, loops_active, leads_back):
            new = CORRECTION
        if new is OK and self._shallow and not self._is_good(altitude_m):
            new = old
        self.state = new
        if new is OK:
            self._shallow = self._unlocked = False
        below = altitude_m is not None and altitude_m < min_m - EPS_M
        locks = new is LOCKED and old is not LOCKED
        # Who backs out already does what a correction asks for: to stop her would leave her to what sets her on.
        corrects = new is CORRECTION and below and not self._shallow and not self._shoal.goes_astern
        if locks:
            self._shallow = self._unlocked = False
        if corrects:
            self._shallow = True
        if new is not old or corrects:
            texts.append(self._text(new, altitude_m))
        return locks or corrects

    def _waits(self, altitude_m: float | None, loops_active: bool, leads_back: bool) -> bool:
        """Whether a lock waits for evidence: it ends a correction, so noise must not. Not while the vessel presses on; one that
        turns back, and closes in her turn, waits in neutral.
        """
        assert altitude_m is not None
        closes = loops_active and self._ahead.closes
        if closes and not leads_back:
            return False
        margin_m, min_m = self._minimum_margin_m, self._min_m
        waits = not self._evidence.proves(
            altitude_m, min_m - margin_m, min_m - _FAR_MARGINS * margin_m, self._config.input.sigma_m
        )
        self._doubts = waits and closes
        return waits

    def _is_good(self, altitude_m: float | None) -> bool:
        assert altitude_m is not None
        return self._evidence.proves_good(altitude_m, self._min_m + self._good_margin_m, self._config.input.sigma_m)

    def _way_fn(
        self, now_us: int, coasting_fn: StoppingDistance | None, braking: Braking | None
    ) -> StoppingDistance | None:
        """The way to rest: by coasting as long as the brake is not allowed."""
        rests = self._brake_until_us <= now_us < self._brake_until_us + _BRAKE_REST_US
        return coasting_fn if braking is None or not self._brakes_astern or rests else braking.way_m

    def _brakes(self, now_us: int, state: EstimatedState | None, braking: Braking | None, *, begins: bool) -> bool:
        """Whether to thrust astern: from the moment that stops, until the way is off, never longer than the hull may need."""
        way_mps = headway_mps(state)
        if braking is not None and now_us < self._brake_until_us:
            late_s = _SEEN_LATE_S + (0.0 if state is None else state.position_age_s or 0.0)
            way_mps = braking.left_mps(way_mps, late_s, (now_us - self._brake_from_us) * 1e-6)
        if braking is None or not self._brakes_astern or way_mps <= braking.until_mps:
            if self._brake_until_us > now_us:
                self._brake_until_us = now_us
        elif begins and now_us >= self._brake_until_us + _BRAKE_REST_US:
            speed_mps = 0.0 if state is None or state.sog_mps is None else state.sog_mps
            self._brake_from_us = now_us
            self._brake_until_us = now_us + round(braking.lasts_s(speed_mps) * 1e6)
        return now_us < self._brake_until_us

    def _text(self, new: GuardState, altitude_m: float | None) -> tuple[Severity, str]:
        limit_m = self._config.min_altitude_m
        if altitude_m is None:
            return Severity.WARNING, f"Depth unknown (limit {limit_m:.2f} m)"
        body = f"Depth {altitude_m:.2f} m, limit {limit_m:.2f} m"
        if new is LOCKED:
            return Severity.CRITICAL, f"{body}: locked, no manoeuvre"
        if new is CORRECTION:
            return Severity.WARNING, f"{body}: correction manoeuvre allowed"
        return Severity.INFO, f"{body}: good"

    def _told_of_pace(self) -> list[tuple[Severity, str]]:
        """Tell that the sounder is slow, where its rate is what looks ahead."""
        told = self._pace.told() if self._config.rate_look_ahead else ""
        return [(Severity.WARNING, told)] if told else []

    def _told_of_sounder(self, altitude_m: float | None) -> list[tuple[Severity, str]]:
        """Tell what is wrong with the sounder once it costs the altitude, or never will by itself; and that it is over."""
        told, is_telling = self._trouble, altitude_m is None or self.input.is_stuck
        if self.input.trouble == told or (self.input.trouble and not is_telling):
            return []
        if self._config.unknown_policy == "ignore" and not self._config.required:
            return []
        self._trouble = self.input.trouble
        if self._trouble:
            return [(Severity.WARNING, self._trouble)]
        return [(Severity.INFO, "Sounder believed again")]

    def _lost_for_s(self, now_us: int) -> float | None:
        """For how long the altitude, which is missing, has been in a way that matters, s; None when it is not."""
        config = self._config
        if config.unknown_policy == "ignore" and not config.required:
            return None
        if self.input.out_of_reach and not config.required:
            return None
        assert self._started_us is not None
        since_start_s = (now_us - self._started_us) / 1e6
        if since_start_s < _START_S:
            return None
        return since_start_s if self.input.gated is None else self.input.age_s(now_us)

    def _stops_when_unknown(self) -> bool:
        return self._config.required or self._config.unknown_policy == "stop"

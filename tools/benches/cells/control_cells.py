"""Measurements of control quality on the truth: one function per row of the project's control table.

Conditions and windows are those of vessel-control §4 and ardupilot-baseline §7. Each cell sails one run and returns
plain numbers; ``tools/benches/control.py`` runs them over seeds and holds them against their bars.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from companion.core.guide import GuidanceConfig
from companion.core.guide.paths import Line
from companion.core.hull import VesselConfig
from companion.core.steer import SteeringConfig
from mavlink_bridge.language.figures import Circle, Figure, FigureEight, Hover, Racetrack, distance_m
from mavlink_bridge.language.messages import Desired, EstimatedState, Loiter
from mavlink_bridge.language.points import NorthEast
from mavlink_bridge.language.units import wrap_pi
from sitl.plant import SimVessel, WaterConfig
from tools.benches.cells.control_loop import TICK_S, ControlLoop, Setup, StateSource

ORIGIN = NorthEast((0.0, 0.0))
CALM = WaterConfig()
BREEZE = WaterConfig(current_mps=0.3, wind_mps=4.0, wave_height_m=0.3)
BLOW = WaterConfig(current_mps=0.5, wind_mps=8.0, wave_height_m=0.3)
WATERS = {"calm": CALM, "0.3 m/s + 4 m/s": BREEZE, "0.5 m/s + 8 m/s": BLOW}
"""The three conditions of vessel-control §4: current to 060°, wind towards 100° with gusts, waves with the wind."""

SourceMaker = Callable[[int], StateSource]
"""Makes a state source from a seed."""


@dataclass(frozen=True, slots=True)
class Case:
    """What a cell needs beside its own numbers."""

    vessel: VesselConfig
    water: WaterConfig = CALM
    steering: SteeringConfig = SteeringConfig()  # noqa: RUF009 - frozen
    guidance: GuidanceConfig = GuidanceConfig()  # noqa: RUF009 - frozen
    belief: VesselConfig | None = None
    seed: int = 1
    delay_s: float = 0.0
    source: SourceMaker | None = None
    outage_s: tuple[float, float] | None = None
    """Span without GNSS; needs a source with sensors."""
    plant: Callable[[VesselConfig], SimVessel] = SimVessel
    """Makes the hull."""
    prepare: Callable[[SimVessel], None] | None = None
    """Faults to switch on in the hull."""

    def loop(self) -> ControlLoop:
        setup = Setup(
            self.vessel,
            water=self.water,
            steering=self.steering,
            guidance=self.guidance,
            belief=self.belief,
            seed=self.seed,
            delay_s=self.delay_s,
            plant=self.plant,
        )
        source = self.source(self.seed) if self.source else None
        if self.outage_s and source is not None:
            source = Outage(source, self.outage_s)
        run = ControlLoop(setup, source)
        if self.prepare:
            self.prepare(run.vessel)
        return run


class Outage:
    """A state source whose GNSS falls silent for a while."""

    def __init__(self, inner: StateSource, span_s: tuple[float, float]) -> None:
        self._inner = inner
        self._span_s = span_s

    def sense(self, now_us: int, vessel: SimVessel, water_mps: float | None, sway_mps: float = 0.0) -> EstimatedState:
        sensors = getattr(self._inner, "sensors", None)
        if sensors is None:
            raise ValueError("an outage needs a source with sensors")
        sensors.faults.gnss_silent = self._span_s[0] <= now_us * 1e-6 < self._span_s[1]
        return self._inner.sense(now_us, vessel, water_mps, sway_mps)


@dataclass(frozen=True, slots=True)
class Errors:
    """Statistics of a signed error, metres."""

    rms: float
    most: float
    mean: float
    p95: float
    activity: float
    """Actuator activity, 1/s and channel."""
    finished: bool = True
    duration_s: float = 0.0


def errors(values: list[float], run: ControlLoop, *, finished: bool = True) -> Errors:
    if not values:
        return Errors(
            rms=math.inf,
            most=math.inf,
            mean=math.inf,
            p95=math.inf,
            activity=run.activity_per_s,
            finished=False,
            duration_s=run.t_s,
        )
    sizes = sorted(abs(value) for value in values)
    count = len(sizes)
    rms = math.sqrt(sum(size * size for size in sizes) / count)
    mean = sum(values) / count
    return Errors(
        rms=rms,
        most=sizes[-1],
        mean=mean,
        p95=sizes[int(0.95 * (count - 1))],
        activity=run.activity_per_s,
        finished=finished,
        duration_s=run.t_s,
    )


class Route:
    """Sails a chain of points as the mission executor would, one go-to after another."""

    def __init__(self, run: ControlLoop, points: list[NorthEast], speed_mps: float, limit_factor: float = 2.5) -> None:
        self.run, self.points, self.speed_mps = run, points, speed_mps
        self.index = 1
        length = sum(math.dist(a, b) for a, b in itertools.pairwise(points))
        self.end_s = run.t_s + limit_factor * length / speed_mps
        self.closest = [math.inf] * len(points)
        self.stopped = ""
        self._begin(None)

    def _begin(self, previous: NorthEast | None) -> None:
        points, k, run = self.points, self.index, self.run
        following = run.goto(*points[k + 1], k + 1) if k + 1 < len(points) else None
        run.sail(run.goto(*points[k], k), run.frame.to_geodetic(*previous) if previous else None, following)

    def tick(self) -> bool:
        """One period; False at the end, or when time is up, or when guidance gives up (``stopped``)."""
        run = self.run
        output = run.tick(self.speed_mps)
        here = (run.vessel.north_m, run.vessel.east_m)
        for k in (self.index - 1, self.index):
            self.closest[k] = min(self.closest[k], math.dist(here, self.points[k]))
        self.stopped = output.unable
        if output.arrived:
            self.index += 1
            if self.index == len(self.points):
                return False
            self._begin(self.points[self.index - 1])
        return run.t_s < self.end_s and not self.stopped

    @property
    def finished(self) -> bool:
        return self.index == len(self.points)


def square(side_m: float, rounds: int = 1, start: NorthEast = ORIGIN) -> list[NorthEast]:
    n, e = start
    corners = [NorthEast(at) for at in ((n + side_m, e), (n + side_m, e + side_m), (n, e + side_m), (n, e))]
    return [start] + corners * rounds


def legs(case: Case, speed_mps: float, side_m: float = 80.0) -> tuple[Errors, float]:
    """80 m square and one leg more; first leg and 20 m after each corner left out.

    Returns the cross-track errors and the mean over legs of each leg's absolute mean.
    """
    points = [*square(side_m), NorthEast((side_m, 0.0))]
    run = case.loop()
    run.place(0.0, 0.0, 0.0, speed_mps)
    route = Route(run, points, speed_mps)
    lead = speed_mps / 0.45 + 0.4 * speed_mps
    by_leg: dict[int, list[float]] = {}
    lines = [Line(a, b) for a, b in itertools.pairwise(points)]
    going = True
    while going:
        going = route.tick()
        k = min(route.index, len(lines)) - 1
        here = lines[k].project(run.vessel.north_m, run.vessel.east_m)
        if k >= 1 and 20.0 < here.along_m < side_m - lead:
            by_leg.setdefault(k, []).append(here.cross_m)
    standing = [abs(sum(values) / len(values)) for values in by_leg.values()]
    flat = [value for values in by_leg.values() for value in values]
    return errors(flat, run, finished=route.finished), sum(standing) / max(1, len(standing))


def _loiter(run: ControlLoop, figure: Figure) -> Loiter:
    return Loiter(0, *run.frame.to_geodetic(0.0, 0.0), figure=figure)


def ring(case: Case, radius_m: float, speed_mps: float, laps: float = 3.0) -> Errors:
    """Circle joined from 8 m outside; radius error after the first lap."""
    run = case.loop()
    run.place(radius_m + 8.0, 0.0, math.pi / 2.0, speed_mps)
    run.sail(_loiter(run, Circle(radius_m=radius_m)))
    swept, last, values = 0.0, 0.0, []
    end_s = ((laps + 1.0) * 2.0 * math.pi * radius_m + 60.0) / speed_mps * 1.6
    while run.t_s < end_s and abs(swept) < 2.0 * math.pi * (laps + 1.0):
        run.tick(speed_mps)
        bearing = math.atan2(run.vessel.east_m, run.vessel.north_m)
        swept += wrap_pi(bearing - last)
        last = bearing
        if abs(swept) > 2.0 * math.pi:
            values.append(math.hypot(run.vessel.north_m, run.vessel.east_m) - radius_m)
    return errors(values, run, finished=abs(swept) >= 2.0 * math.pi * (laps + 1.0))


def pattern(
    case: Case, kind: type[Racetrack | FigureEight], radius_m: float, speed_mps: float, laps: float = 2.0
) -> Errors:
    """Racetrack with 60 m straights or figure-eight of touching loops; distance to the path after the first lap."""
    run = case.loop()
    figure = kind(length_m=60.0 if kind is Racetrack else 2.0 * radius_m, radius_m=radius_m, bearing_rad=0.0)
    segments = figure.segments(ORIGIN, radius_m, 1)
    north, east = segments[0].point(0.0)
    course = segments[0].project(north, east).course_rad
    run.place(north, east, course, speed_mps)
    run.sail(_loiter(run, figure))
    lap_s = sum(segment.length_m for segment in segments) / speed_mps
    values: list[float] = []
    turns = 0.0
    while turns < 1.0 + laps and run.t_s < 1.6 * lap_s * (1.0 + laps) + 60.0:
        turns = run.tick(speed_mps).turns
        if turns > 1.0:
            values.append(distance_m(segments, run.vessel.north_m, run.vessel.east_m))
    return errors(values, run, finished=turns >= 1.0 + laps)


def hover(case: Case, seconds: float = 400.0, settle_s: float = 100.0) -> Errors:
    """Station keeping from the point itself; distance after 100 s."""
    run = case.loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(_loiter(run, Hover()))
    values = []
    while run.t_s < seconds:
        run.tick(1.5)
        if run.t_s > settle_s:
            values.append(math.hypot(run.vessel.north_m, run.vessel.east_m))
    return errors(values, run)


@dataclass(frozen=True, slots=True)
class SquareRun:
    """The 100 m square of ardupilot-baseline §7."""

    whole: Errors
    """Distance to the nearest leg, everything from the first corner on."""
    straight: Errors
    """20 m after a corner to 5 m before the next."""
    reached: int
    """Points that guidance reported reached, of 9."""
    closest_m: float
    """Greatest of the distances at which the points were passed."""
    stopped: str
    """Guidance's reason for giving up, empty if it did not."""
    ends_at_m: float
    """Distance from the start at the end."""
    thrust_after: float = 0.0
    """Greatest command in the 30 s after giving up."""


def big_square(case: Case, speed_mps: float) -> SquareRun:
    """100 m sides, first point 20 m north of the start, driven twice; environment on after 25 s at rest."""
    points = [ORIGIN, *square(100.0, 2, NorthEast((20.0, 0.0)))]
    water = case.water.model_copy(update={"start_s": 25.0})
    run = replace(case, water=water).loop()
    run.place(0.0, 0.0, 0.0)
    while run.t_s < 25.0:
        run.steer(Desired(None, None))
    route = Route(run, points, speed_mps, limit_factor=3.5)
    lines = [Line(a, b) for a, b in itertools.pairwise(points)]
    whole, straight, going = [], [], True
    while going:
        going = route.tick()
        k = min(route.index, len(lines)) - 1
        if k < 1:
            continue
        north, east = run.vessel.north_m, run.vessel.east_m
        whole.append(distance_m(tuple(lines), north, east))
        here = lines[k].project(north, east)
        if 20.0 < here.along_m < 95.0:
            straight.append(here.cross_m)
    after = 0.0
    for _ in range(round(30.0 / TICK_S) if route.stopped else 0):
        run.tick(speed_mps)
        if run.sent is not None:
            after = max(after, abs(run.sent.thruster_port), abs(run.sent.thruster_starboard))
    reached, closest = route.index - 1, max(route.closest[1:])
    done = route.finished
    away = math.hypot(run.vessel.north_m, run.vessel.east_m)
    return SquareRun(
        whole=errors(whole, run, finished=done),
        straight=errors(straight, run, finished=done),
        reached=reached,
        closest_m=closest,
        stopped=route.stopped,
        ends_at_m=away,
        thrust_after=after,
    )


def ring_entry(case: Case, radius_m: float, speed_mps: float) -> float:
    """Circle ordered at rest at its centre: greatest distance outside the ring in the first lap, m."""
    run = case.loop()
    run.place(0.0, 0.0, 0.0)
    run.sail(_loiter(run, Circle(radius_m=radius_m)))
    outside = 0.0
    end_s = (2.0 * math.pi + 1.0) * radius_m / speed_mps + 30.0
    touched = False
    while run.t_s < end_s:
        run.tick(speed_mps)
        gap = math.hypot(run.vessel.north_m, run.vessel.east_m) - radius_m
        touched = touched or gap > -0.3
        outside = max(outside, gap)
    return outside if touched else math.inf


@dataclass(frozen=True, slots=True)
class Step:
    """A step response: time to 90 %, overshoot, and when it stays in its band."""

    t90_s: float
    overshoot: float
    settled_s: float
    lowest: float = 0.0


def heading_step(case: Case, speed_mps: float, angle_rad: float = math.pi / 2.0, settle_s: float = 15.0) -> Step:
    """Step of the heading after 15 s of steady running; overshoot in rad, settled to 3°."""
    run = case.loop()
    run.place(0.0, 0.0, 0.0, speed_mps)
    series = []
    turned, last, lowest = 0.0, run.vessel.psi_rad, math.inf
    while run.t_s < settle_s + 35.0:
        run.steer(Desired(0.0 if run.t_s < settle_s else angle_rad, speed_mps))
        turned += wrap_pi(run.vessel.psi_rad - last)
        last = run.vessel.psi_rad
        if run.t_s >= settle_s:
            series.append((run.t_s - settle_s, turned))
            lowest = min(lowest, run.vessel.u_mps)
    return _measure(series, angle_rad, math.radians(3.0), lowest)


def speed_step(case: Case, start_mps: float = 0.5, end_mps: float = 2.0, settle_s: float = 20.0) -> Step:
    """Step of the speed; overshoot in m/s, settled to 5 % of the step."""
    run = case.loop()
    run.place(0.0, 0.0, 0.0, start_mps)
    series = []
    while run.t_s < settle_s + 40.0:
        run.steer(Desired(0.0, start_mps if run.t_s < settle_s else end_mps))
        if run.t_s >= settle_s:
            series.append((run.t_s - settle_s, run.vessel.surge_over_ground_mps - start_mps))
    rise = end_mps - start_mps
    return _measure(series, rise, 0.05 * rise, 0.0)


def _measure(series: list[tuple[float, float]], goal: float, band: float, lowest: float) -> Step:
    t90 = next((t for t, value in series if value > 0.9 * goal), math.inf)
    overshoot = max(value for _, value in series) - goal
    settled = max([t for t, value in series if abs(value - goal) > band], default=0.0)
    return Step(t90, overshoot, settled, lowest)

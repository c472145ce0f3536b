"""The control table: every row of control quality, over seeds, held against its bar.

``run()`` returns a list of {name, value, unit, bar, holds}; ``python -m tools.benches.control`` prints it. Each row sails
the default vessel unless it says "plant B", with RTK-class sensors through their NMEA sentences.
"""

from __future__ import annotations

import argparse
import functools
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing import Pool
from typing import Any

from companion.core.hull import VesselConfig
from companion.core.steer import SteeringConfig
from companion.core.steer.law import SeedConfig
from companion.core.steer.pid import PidGains
from mavlink_bridge.language.figures import FigureEight, Racetrack
from sitl.plant import SimVessel, WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells import control_cells as cells, pursuit_cells
from tools.benches.cells.control_cells import BLOW, CALM, WATERS, Case, Errors
from tools.benches.cells.foreign_hulls import any_hull, bare
from tools.benches.cells.hover_cells import held
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.shear_cells import Current, eddy_line, leg_through, turning

SEEDS = (1, 2, 3, 4, 5)
SPEEDS = (1.5, 2.5)
SEED_GAINS = {"heading_gains": PidGains(kp=1.8, ki=0.005, kd=0.4), "speed_gains": PidGains(kp=0.6, ki=0.15)}
SEED_LAW = SteeringConfig(profile="seed", seed=SeedConfig(**SEED_GAINS))
SWAPPED = SteeringConfig(
    profile="seed",
    seed=SeedConfig(**SEED_GAINS, low_speed_thruster_share=0.8, high_speed_thruster_share=0.2),
)
SEED_RINGS = {
    (10, 1.5): (0.21, 1.97, 5.94),
    (10, 2.5): (0.94, 2.33, 4.91),
    (20, 1.5): (0.09, 0.46, 1.56),
    (20, 2.5): (0.16, 0.47, 0.91),
    (50, 1.5): (0.05, 0.47, 0.85),
    (50, 2.5): (0.13, 0.48, 0.84),
}
SEED_LEGS = {1.5: (2.79, 5.77, 9.04), 2.5: (3.04, 4.62, 6.47)}
"""RMS of the "seed" columns of vessel-control §4.2 and §4.3: calm, 0.3 + 4, 0.5 + 8."""

Figures = dict[str, float]
Cell = Callable[[int], Figures]


@dataclass(frozen=True, slots=True)
class Row:
    """One line: a cell sailed with every seed, and for each of its figures how seeds combine and what must hold."""

    name: str
    cell: Cell
    bars: dict[str, float]
    """Upper bars by figure; the worst seed counts."""
    unit: str = "m"
    seeds: tuple[int, ...] = SEEDS


def case(
    vessel: str = "otter",
    water: WaterConfig = CALM,
    seed: int = 1,
    bias_deg: float = 0.0,
    **more: Any,
) -> Case:
    """A vessel in its water with RTK-class sensors; bias_deg is on the compass."""
    source = functools.partial(SensedState, heading_bias_deg=bias_deg)
    return Case(load_vessel(vessel), water, seed=seed, source=source, **more)


def _plain(result: Errors) -> Figures:
    if not result.finished:
        return {"rms": math.inf, "max": math.inf, "bias": math.inf, "p95": math.inf, "activity": result.activity}
    return {
        "rms": result.rms,
        "max": result.most,
        "bias": abs(result.mean),
        "p95": result.p95,
        "activity": result.activity,
    }


def _legs(water: str, speed: float, seed: int) -> Figures:
    return _plain(cells.legs(case(water=WATERS[water], seed=seed), speed)[0])


def _ring(water: str, radius: float, speed: float, seed: int) -> Figures:
    return _plain(cells.ring(case(water=WATERS[water], seed=seed), radius, speed))


def _pattern(kind: type[Racetrack | FigureEight], water: str, radius: float, speed: float, seed: int) -> Figures:
    return _plain(cells.pattern(case(water=WATERS[water], seed=seed), kind, radius, speed))


def _hover(water: str, seed: int) -> Figures:
    return _plain(cells.hover(case(water=WATERS[water], seed=seed)))


def _square(current: float, speed: float, seed: int) -> Figures:
    water = WaterConfig(current_mps=current, current_to_deg=90.0)
    result = cells.big_square(case("plant_b", water, seed), speed)
    figures = {f"straight {name}": value for name, value in _plain(result.straight).items()}
    extra = {"unreached": 9.0 - result.reached, "passed at": result.closest_m, "duration": result.whole.duration_s}
    return _plain(result.whole) | figures | extra


def _corners(current: float, seed: int) -> Figures:
    water = WaterConfig(current_mps=current, current_to_deg=90.0)
    return _plain(cells.big_square(case(water=water, seed=seed), 1.5).whole)


def _shear(current: Current, seed: int) -> Figures:
    return _plain(leg_through(case(seed=seed), current, 1.5))


def _launch(water: str, seed: int) -> Figures:
    return _plain(cells.legs(replace(case(water=WATERS[water], seed=seed), vessel=any_hull("launch")), 1.5)[0])


def _rows_of_trials() -> list[Row]:
    """What strangers' trials found weak, on the default hull and on a launch with slow propellers."""
    part = functools.partial
    table = [
        Row(f"whole legs with corners, {mps} m/s current", part(_corners, mps), {"rms": 0.13}) for mps in (0.0, 0.5)
    ]
    table.append(Row("whole legs with corners, 1.2 m/s current", part(_corners, 1.2), {"rms": 0.5, "max": 4.0}))
    table.append(Row("leg across an eddy line, 0.7 m/s each 25 m", part(_shear, eddy_line), {"rms": 0.6}))
    table.append(Row("leg in a current that turns 4.5° a metre, 0.6 m/s", part(_shear, turning), {"rms": 0.4}))
    for water, bar in (("calm", 0.15), ("0.5 m/s + 8 m/s", 0.3)):
        table.append(Row(f"launch of slow propellers, legs 1.5 m/s, {water}", part(_launch, water), {"rms": bar}))
    return table


def _overpowered(speed: float, seed: int) -> Figures:
    water = WaterConfig(current_mps=3.5, current_to_deg=90.0)
    result = cells.big_square(case("plant_b", water, seed), speed)
    return {"unstopped": 0.0 if result.stopped and result.thrust_after == 0.0 else 1.0}


def _entry(radius: float, speed: float, seed: int) -> Figures:
    return {"overshoot": cells.ring_entry(case("plant_b", seed=seed), radius, speed)}


def _biased(speed: float, seed: int) -> Figures:
    return {"standing": cells.legs(case(seed=seed, bias_deg=1.2), speed)[1]}


def _heading_step(seed: int) -> Figures:
    step = cells.heading_step(case(seed=seed), 1.5)
    return {"t90": step.t90_s, "overshoot": math.degrees(step.overshoot), "settled": step.settled_s}


def _speed_step(seed: int) -> Figures:
    step = cells.speed_step(case(seed=seed))
    return {"overshoot": step.overshoot, "settled": step.settled_s}


def _rudders_matter(seed: int) -> Figures:
    """Overshoot with rudder force over that without, of the seed's law with swapped shares."""
    dead = load_vessel("otter").model_copy(
        update={"rudder": load_vessel("otter").rudder.model_copy(update={"lift_slope_per_rad": 1e-9})}
    )
    with_force = cells.heading_step(case(seed=seed, steering=SWAPPED), 2.5).overshoot
    without = cells.heading_step(replace(case(seed=seed, steering=SWAPPED), vessel=dead), 2.5).overshoot
    return {"share": max(with_force, 0.0) / without}


def _seed_ring(water: int, radius: int, speed: float, seed: int) -> Figures:
    name = list(WATERS)[water]
    got = _mean_square(
        lambda s: pursuit_cells.pursuit_ring(case(water=WATERS[name], seed=s, steering=SEED_LAW), radius, speed)
    )
    return {"off": _off(got, SEED_RINGS[radius, speed][water]), "rms": got}


def _seed_legs(water: int, speed: float, seed: int) -> Figures:
    name = list(WATERS)[water]
    got = _mean_square(lambda s: pursuit_cells.pursuit_legs(case(water=WATERS[name], seed=s, steering=SEED_LAW), speed))
    return {"off": _off(got, SEED_LEGS[speed][water]), "rms": got}


def _mean_square(cell: Callable[[int], Errors]) -> float:
    """RMS over three seeds, as the table to compare with was made."""
    return math.sqrt(sum(cell(seed).rms ** 2 for seed in (1, 2, 3)) / 3.0)


def _off(got: float, wanted: float) -> float:
    """Distance from the wanted value over what is allowed: 20 % or 0.05 m, whichever is more."""
    return abs(got - wanted) / max(0.2 * wanted, 0.05)


def _break_port(hull: SimVessel) -> None:
    hull.thruster_health[0] = 0.7


def _jam_rudder(hull: SimVessel) -> None:
    hull.rudder_stuck_rad[0] = math.radians(10.0)


def robust_cases(seed: int) -> dict[str, Case]:
    """The robustness set of vessel-control §4.6: the controller believes in the vessel of the file."""
    base = case(water=WATERS["0.3 m/s + 4 m/s"], seed=seed)
    belief = base.vessel

    def other(vessel: VesselConfig) -> Case:
        return replace(base, vessel=vessel, belief=belief)

    biased = functools.partial(SensedState, heading_bias_deg=5.0)
    return {
        "mass +30 %": other(belief.scaled(mass=1.3)),
        "drag +30 %": other(belief.scaled(drag=1.3)),
        "drag -30 %": other(belief.scaled(drag=0.7)),
        "port thruster at 70 %": replace(base, prepare=_break_port),
        "port rudder stuck at 10 deg": replace(base, prepare=_jam_rudder),
        "delay 0.3 s": replace(base, delay_s=0.3),
        "heading bias 5 deg": replace(base, source=biased),
        "GNSS outage 10 s": replace(base, outage_s=(60.0, 70.0)),
    }


@functools.cache
def _nominal(seed: int) -> float:
    return cells.legs(case(water=WATERS["0.3 m/s + 4 m/s"], seed=seed), 1.5)[0].rms


def _robust(name: str, seed: int) -> Figures:
    result = cells.legs(robust_cases(seed)[name], 1.5)[0]
    return {"times nominal": result.rms / _nominal(seed) if result.finished else math.inf}


def _bare_legs(name: str, munk: float, speed: float, seed: int) -> Figures:
    hull = replace(case(water=BLOW, seed=seed), vessel=bare(name, munk))
    return _plain(cells.legs(hull, speed)[0])


def _bare_ring(name: str, munk: float, speed: float, seed: int) -> Figures:
    hull = replace(case(water=BLOW, seed=seed), vessel=bare(name, munk))
    return _plain(cells.ring(hull, 20.0, speed))


def _rows_of_hulls() -> list[Row]:
    """Hulls without rudders that turn away by themselves, with their exact file."""
    part, table = functools.partial, []
    for munk in (0.5, 1.0):
        for speed, bar in ((1.5, 0.12), (2.5, 0.3)):
            name = f"otter without rudders, munk {munk}, {speed} m/s, 0.5 m/s + 8 m/s"
            table.append(Row(f"legs, {name}", part(_bare_legs, "otter", munk, speed), {"rms": bar}))
            table.append(Row(f"circle R 20, {name}", part(_bare_ring, "otter", munk, speed), {"rms": 0.3}))
    return table


def _held(hull: str, wind: float, current: float, seed: int) -> Figures:
    vessel = bare(*_BARE[hull]) if hull in _BARE else load_vessel(hull)
    here = replace(case(water=WaterConfig(wind_mps=wind, current_mps=current), seed=seed), vessel=vessel)
    found, spared = held(here), held(here, "drift")
    return {
        "rms": found.rms_m,
        "max": found.most_m,
        "swept": found.swept_deg,
        "full thrust": found.full_share,
        "drift over weathervane": spared.power / found.power,
    }


_BARE = {"otter without rudders": ("otter", 1.0)}


def _rows_of_station() -> list[Row]:
    """Wind with little or no current, the commonest weather on a lake."""
    bars = {"rms": 0.3, "max": 1.0, "swept": 180.0, "full thrust": 0.05, "drift over weathervane": 1.0}
    return [
        Row(
            f"hold, {hull}, wind {wind:g} m/s, current {current:g} m/s",
            functools.partial(_held, hull, wind, current),
            bars,
            "m, °",
        )
        for hull in ("otter", *_BARE, "blueboat")
        for wind, current in ((2.0, 0.0), (5.0, 0.0), (5.0, 0.1), (10.0, 0.0), (10.0, 0.3))
    ]


def rows() -> list[Row]:
    """The whole table."""
    table = []
    part = functools.partial
    for water in WATERS:
        for speed in SPEEDS:
            table.append(Row(f"legs {speed} m/s, {water}", part(_legs, water, speed), {"rms": 0.15, "max": 0.6}))
            for radius in (10, 20, 50):
                bars = {"rms": 0.25, "max": 0.7, "bias": 0.05}
                table.append(Row(f"circle R {radius}, {speed} m/s, {water}", part(_ring, water, radius, speed), bars))
            for kind in (Racetrack, FigureEight):
                for radius in (15, 25):
                    name = f"{kind.name} R {radius}, {speed} m/s, {water}"
                    table.append(Row(name, part(_pattern, kind, water, radius, speed), {"rms": 0.25, "max": 0.75}))
    for water in WATERS:
        bars = {"rms": 0.5, "p95": 0.9} if water == "0.5 m/s + 8 m/s" else {}
        table.append(Row(f"hover, {water}", part(_hover, water), bars))
    table += _rows_against_peer() + _rows_of_loops()
    return table + _rows_of_hulls() + _rows_of_station() + _rows_of_trials()


def _rows_against_peer() -> list[Row]:
    part, table = functools.partial, []
    for speed in SPEEDS:
        bars = {"rms": 0.4, "max": 2.0, "unreached": 0.0}
        table.append(Row(f"plant B, square, 0.5 m/s current, {speed} m/s", part(_square, 0.5, speed), bars))
    for current, speed in ((2.0, 2.5), (1.25, 1.5)):
        bars = {"straight rms": 1.0, "unreached": 0.0}
        table.append(Row(f"plant B, square, {current} m/s current, {speed} m/s", part(_square, current, speed), bars))
    table.append(Row("plant B, 3.5 m/s current: stopped", part(_overpowered, 2.5), {"unstopped": 0.0}, ""))
    for radius in (10, 20, 50):
        for speed in SPEEDS:
            name = f"plant B, circle from its centre, R {radius}, {speed} m/s"
            table.append(Row(name, part(_entry, radius, speed), {"overshoot": 0.5}))
    bars = {"standing": 0.05}
    return table + [Row(f"legs with heading off by 1.2°, {speed} m/s", part(_biased, speed), bars) for speed in SPEEDS]


def _rows_of_loops() -> list[Row]:
    part = functools.partial
    table = [
        Row("heading step 90° at 1.5 m/s", _heading_step, {"t90": 4.5, "overshoot": 2.0, "settled": 5.0}, "s, °, s"),
        Row("speed step 0.5 to 2 m/s", _speed_step, {"overshoot": 0.25, "settled": 3.0}, "m/s, s"),
        Row("rudders matter: overshoot with over without", _rudders_matter, {"share": 0.2}, "", (1,)),
    ]
    bars = {"times nominal": 3.0}
    table += [Row(f"robust: {name}", part(_robust, name), bars, "", (1, 2, 3)) for name in robust_cases(1)]
    for water, condition in enumerate(WATERS):
        for radius, speed in SEED_RINGS:
            name = f"seed law, circle R {radius}, {speed} m/s, {condition}: off over allowed"
            table.append(Row(name, part(_seed_ring, water, radius, speed), {"off": 1.0}, "", (1,)))
        for speed in SPEEDS:
            name = f"seed law, legs {speed} m/s, {condition}: off over allowed"
            table.append(Row(name, part(_seed_legs, water, speed), {"off": 1.0}, "", (1,)))
    return table


def _sail(job: tuple[int, int]) -> tuple[int, Figures]:
    index, seed = job
    return index, rows()[index].cell(seed)


def run(seeds: tuple[int, ...] = SEEDS, match: str = "", processes: int = 2) -> list[dict[str, Any]]:
    """Sail every row whose name contains ``match``; return the table."""
    table = rows()
    jobs = [(k, s) for k, row in enumerate(table) if match in row.name for s in row.seeds if s in seeds]
    worst: dict[int, Figures] = {}
    with Pool(processes) as pool:
        for index, figures in pool.imap_unordered(_sail, jobs):
            old = worst.setdefault(index, dict(figures))
            worst[index] = {name: max(old[name], value) for name, value in figures.items()}
    result = [
        _line(table[k], figure, worst[k][figure], bar) for k in sorted(worst) for figure, bar in table[k].bars.items()
    ]
    activity = [figures["activity"] for figures in worst.values() if "activity" in figures]
    if activity:
        holds = max(activity) <= 0.25
        result.append(_entry_of("actuator activity, all rows", max(activity), "1/s", 0.25, holds=holds))
    return result


def _line(row: Row, figure: str, value: float, bar: float) -> dict[str, Any]:
    return _entry_of(f"{row.name}: {figure}", value, row.unit, bar, holds=value <= bar + 1e-9)


def _entry_of(name: str, value: float, unit: str, bar: float, *, holds: bool) -> dict[str, Any]:
    return {"name": f"control: {name}", "value": round(value, 4), "unit": unit, "bar": bar, "holds": holds}


def main() -> int:
    """Print the table; exit status 1 when a bar is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="sail seeds 1 to N")
    parser.add_argument("--match", default="", help="only rows whose name contains this")
    arguments = parser.parse_args()
    lines = run(tuple(range(1, arguments.seeds + 1)), arguments.match)
    for line in lines:
        print(
            f"{'ok ' if line['holds'] else 'NOT'} {line['value']:9.3f} (bar {line['bar']:g} {line['unit']})  {line['name']}"
        )
    return 0 if all(line["holds"] for line in lines) else 1


if __name__ == "__main__":
    sys.exit(main())

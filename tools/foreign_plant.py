"""Our law on hulls that nobody here wrote: two boats of Fossen's Python Vehicle Simulator, from a checkout of it.

``python -m tools.foreign_plant CHECKOUT`` sails legs, corners, circles and, where the foreign model is valid at rest, station keeping,
each by two vessel files: one of the figures that the model's author gives, and one that is wrong. With ``--trial`` it sails a sea
trial by the latter, fits a file to the record, and holds that against what the hull itself does.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from companion.core.hull import VesselConfig
from companion.core.hull.statics import Statics, command_for_thrust, drag_n
from companion.core.trial import TrialConfig
from companion.tuning.fit import fit_vessel
from companion.tuning.fitted import fitted_vessel
from companion.tuning.voyages import read_voyage
from mavlink_bridge.language.messages import ActuatorDemand
from sitl.plant import SimVessel, WaterConfig
from sitl.plant.library import load_vessel
from tools.benches.cells import control_cells as cells
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.hover_cells import held
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.trial_cells import sail_trial, steady, turn_rate, wrong
from tools.foreign_boats import boats

_SEA = WaterConfig(current_mps=0.4, wind_mps=5.0, wave_height_m=0.15)
"""A day on which a person would sail a trial."""
_THROTTLES, _TURNING, _HELM = (0.2, 0.35, 0.65, 0.95), (0.0, 0.3, 0.6), 0.5
_COASTING_MPS = (1.0, 2.0)
_COASTED_S, _COAST_DT_S = 60.0, 0.02
"""Fifty times the hull's own time: it lies still by then."""


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--boat", choices=("otter", "tanker"), default="otter")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--trial", action="store_true", help="sail a sea trial, fit it, and judge the fit by the hull")
    arguments = parser.parse_args()
    if arguments.trial and arguments.boat != "otter":
        parser.error(f"the model of the {arguments.boat} is not valid at rest and astern, where a trial takes it")
    try:
        exact, plant = boats(arguments.checkout)[arguments.boat]
    except FileNotFoundError as error:
        parser.error(str(error))
    told, other = _wrong_file(arguments.boat, exact)
    if arguments.trial:
        judge_trial(exact, other, plant, arguments.seed)
        return 0
    for belief_told, belief in {"author's figures": exact, told: other}.items():
        for name, water in WATERS.items():
            case = Case(exact, water, belief=belief, seed=arguments.seed, source=SensedState, plant=plant)
            _tell(f"{belief_told}, {name}", case, is_held=arguments.boat == "otter")
    return 0


def _wrong_file(boat: str, exact: VesselConfig) -> tuple[str, VesselConfig]:
    """Return what a person would begin with, and its name: the nearest shipped file, or one of figures that are off by up to half."""
    if boat == "otter":
        shipped = load_vessel("otter")
        return "shipped Otter", exact.model_copy(update={"hull": shipped.hull, "thruster": shipped.thruster})
    return "wrong by half", wrong(exact, 1)


def judge_trial(
    exact: VesselConfig, start: VesselConfig, plant: Callable[[VesselConfig], SimVessel], seed: int
) -> None:
    """Sail a trial by ``start``, fit it, and print what hull, start and fitted file do: speeds, turns, ways to rest."""
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "trial.csv"
        sailed = sail_trial(
            exact, _SEA, TrialConfig(), record, belief=start, seed=seed, source=SensedState(seed), plant=plant
        )
        print(f"{sailed.texts[-1]} ({sailed.seconds:.0f} s)", flush=True)
        found = fitted_vessel(fit_vessel(start, read_voyage(record)))
    print(f"{'':34}{'the hull':>10}{'file':>10}{'fitted':>10}")
    said, fitted = _of_file(start), _of_file(found)
    for what, right in _of_plant(exact, plant).items():
        off = (100.0 * (of[what] / right - 1.0) for of in (said, fitted))
        print(f"{what:34}{right:10.3f}" + "".join(f"{percent:+9.1f}%" for percent in off))


def _of_plant(exact: VesselConfig, plant: Callable[[VesselConfig], SimVessel]) -> dict[str, float]:
    found = {_speed(c): steady(plant(exact), ActuatorDemand(0, c, c)).u_mps for c in _THROTTLES}
    found |= {_turn(c): turn_rate(exact, c, _HELM, plant) for c in _TURNING}
    hull = plant(exact)
    for mps in _COASTING_MPS:
        command = command_for_thrust(exact, 0.5 * drag_n(exact, mps))
        steady(hull, ActuatorDemand(0, command, command)).place(surge_mps=mps)
        for _ in range(round(_COASTED_S / _COAST_DT_S)):
            hull.step(_COAST_DT_S, 0.0, 0.0, rudder_port_rad=0.0, rudder_starboard_rad=0.0)
        found[_rest(mps)] = hull.north_m
    return found


def _of_file(vessel: VesselConfig) -> dict[str, float]:
    statics = Statics(vessel)
    found = {_speed(c): statics.throttle_to_speed(c) for c in _THROTTLES}
    found |= {_turn(c): turn_rate(vessel, c, _HELM) for c in _TURNING}
    return found | {_rest(mps): statics.stopping_distance_m(mps) for mps in _COASTING_MPS}


def _speed(throttle: float) -> str:
    return f"speed at {throttle:.0%} throttle, m/s"


def _turn(throttle: float) -> str:
    return f"turn at {throttle:.0%} and half helm, rad/s"


def _rest(mps: float) -> str:
    return f"way to rest from {mps:g} m/s, m"


def _tell(what: str, case: Case, *, is_held: bool) -> None:
    legs, _ = cells.legs(case, 1.5)
    ring = cells.ring(case, 20.0, 1.5)
    whole = cells.big_square(case, 1.5).whole
    told = f"legs {legs.rms:.3f} m RMS, circle R20 {ring.rms:.3f}, corners {whole.rms:.3f} (most {whole.most:.1f})"
    if is_held:
        wind = WaterConfig(wind_mps=case.water.wind_mps, current_mps=case.water.current_mps)
        still = held(replace(case, water=wind), seconds=200.0)
        told += f", held {still.rms_m:.3f} (most {still.most_m:.2f}, swept {still.swept_deg:.0f} deg)"
    print(f"{what:40} {told}", flush=True)


if __name__ == "__main__":
    raise SystemExit(main())

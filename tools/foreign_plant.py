"""Our law on a hull that nobody here wrote: the 6-degree Otter of Fossen's Python Vehicle Simulator, from a checkout of it.

``python -m tools.foreign_plant CHECKOUT`` sails legs, corners, circles and station keeping on it with two vessel files: one of
the figures that its author gives, and the shipped Otter's without rudders. With ``--trial`` it sails a sea trial on it by the latter,
fits a file to the record, and holds that against what the hull itself does. Nothing of it is ours but the wind, which it lacks.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import math
import sys
import tempfile
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from companion.core.hull import VesselConfig
from companion.core.hull.statics import Statics
from companion.core.trial import TrialConfig
from companion.tuning.fit import fit_vessel
from companion.tuning.fitted import fitted_vessel
from companion.tuning.voyages import read_voyage
from mavlink_bridge.language.messages import ActuatorDemand
from mavlink_bridge.language.units import wrap_pi
from sitl.plant import SimVessel, WaterConfig
from sitl.plant.library import load_vessel
from sitl.plant.water import STILL, Conditions
from tools.benches.cells import control_cells as cells
from tools.benches.cells.control_cells import WATERS, Case
from tools.benches.cells.hover_cells import held
from tools.benches.cells.sensed import SensedState
from tools.benches.cells.trial_cells import sail_trial, steady, turn_rate

_SEA = WaterConfig(current_mps=0.4, wind_mps=5.0, wave_height_m=0.15)
"""A day on which a person would sail a trial."""
_THROTTLES, _TURNING, _HELM = (0.2, 0.35, 0.65, 0.95), (0.0, 0.3, 0.6), 0.5
_COASTING_MPS = (1.0, 2.0)
_COASTED_S, _COAST_DT_S = 60.0, 0.02
"""Fifty times the hull's own time: it lies still by then."""
_PACKAGE = "python_vehicle_simulator"


def otter_of(checkout: Path) -> Callable[[], Any]:
    """Return the class of the foreign Otter; its packages' own imports (animations, plots) are left out.

    Raises ``FileNotFoundError`` where the checkout has none.
    """
    root = checkout / "src" / _PACKAGE
    if not (root / "vehicles" / "otter.py").exists():
        raise FileNotFoundError(f"{root}/vehicles/otter.py: not a checkout of PythonVehicleSimulator")
    for name, folder in (
        (_PACKAGE, root),
        (f"{_PACKAGE}.lib", root / "lib"),
        (f"{_PACKAGE}.vehicles", root / "vehicles"),
    ):
        package = types.ModuleType(name)
        package.__path__ = [str(folder)]
        sys.modules[name] = package
    otter: Callable[[], Any] = importlib.import_module(f"{_PACKAGE}.vehicles.otter").otter
    return otter


def file_of(otter: Any) -> VesselConfig:
    """Return the vessel file of the figures that the author gives: masses, damping, bollard pulls."""
    mass, damping = otter.M, np.diag(otter.D)
    shipped = load_vessel("otter")
    hull = {
        "mass_kg": otter.m_total,
        "m11_kg": mass[0, 0],
        "m22_kg": mass[1, 1],
        "m23_kgm": mass[1, 5],
        "m33_kgm2": mass[5, 5],
        "xu": damping[0],
        "xuu": 0.0,
        "yv": damping[1],
        "nr": damping[5],
        "nrr": 10.0 * damping[5],
        "munk": 1.0,
    }
    thruster = {
        "lateral_m": otter.l2,
        "ahead_n": otter.k_pos * otter.n_max**2,
        "astern_n": otter.k_neg * otter.n_min**2,
        "lag_s": otter.T_n,
        "dead_band": 0.0,
    }
    return shipped.model_copy(
        update={
            "name": "Fossen's Otter",
            "hull": shipped.hull.model_copy(update={name: float(figure) for name, figure in hull.items()}),
            "thruster": shipped.thruster.model_copy(update={name: float(figure) for name, figure in thruster.items()}),
            "rudder": shipped.rudder.model_copy(update={"count": 0}),
        }
    )


class ForeignOtter(SimVessel):
    """Moves as the foreign model says; what the sensors see is the same as of our own hulls."""

    def __init__(self, config: VesselConfig, make: Callable[[], Any]) -> None:
        super().__init__(config)
        self._otter = make()
        self._eta, self._nu, self._n = np.zeros(6), np.zeros(6), np.zeros(2)

    def place(self, *, north_m: float = 0.0, east_m: float = 0.0, psi_rad: float = 0.0, surge_mps: float = 0.0) -> None:
        super().place(north_m=north_m, east_m=east_m, psi_rad=psi_rad, surge_mps=surge_mps)
        self._eta[[0, 1, 5]] = north_m, east_m, psi_rad
        self._nu[:] = surge_mps, 0.0, 0.0, 0.0, 0.0, 0.0

    def step(
        self,
        dt_s: float,
        thruster_port: float,
        thruster_starboard: float,
        rudder_port_rad: float,
        rudder_starboard_rad: float,
        water: Conditions = STILL,
    ) -> None:
        """Advance by ``dt_s``; it has no rudders."""
        otter, eta = self._otter, self._eta
        otter.V_c = math.hypot(water.current_n_mps, water.current_e_mps)
        otter.beta_c = math.atan2(water.current_e_mps, water.current_n_mps)
        wanted = np.array([self._turns(thruster_port), self._turns(thruster_starboard)])
        surge_n, sway_n, yaw_nm = self.weather(water, math.cos(eta[5]), math.sin(eta[5]))
        # of its payload's weight the trim makes a push ahead that nothing takes up: 6 N, for which it sails without thrust
        surge_n += float(otter.mp * otter.g) * math.sin(eta[4])
        nu, self._n = otter.dynamics(eta, self._nu, self._n, wanted, dt_s)
        self._nu = nu + otter.Minv @ np.array([surge_n, sway_n, 0.0, 0.0, 0.0, yaw_nm]) * dt_s
        gnc = sys.modules[f"{_PACKAGE}.lib.gnc"]
        self._eta = eta = gnc.attitudeEuler(eta, self._nu, dt_s)
        self.north_m, self.east_m, self.psi_rad = float(eta[0]), float(eta[1]), wrap_pi(float(eta[5]))
        cosine, sine = math.cos(self.psi_rad), math.sin(self.psi_rad)
        surge, sway, self.r_radps = float(self._nu[0]), float(self._nu[1]), float(self._nu[5])
        self.vn_mps, self.ve_mps = surge * cosine - sway * sine, surge * sine + sway * cosine
        self.u_mps = surge - water.current_n_mps * cosine - water.current_e_mps * sine
        self.v_mps = sway - water.current_e_mps * cosine + water.current_n_mps * sine
        self.roll_rad, self.pitch_rad, self.heave_m = float(eta[3]), float(eta[4]), -float(eta[2])

    def _turns(self, command: float) -> float:
        """Shaft speed of a command, rad/s."""
        return command * float(self._otter.n_max if command > 0.0 else -self._otter.n_min)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--trial", action="store_true", help="sail a sea trial, fit it, and judge the fit by the hull")
    arguments = parser.parse_args()
    try:
        make = otter_of(arguments.checkout)
    except FileNotFoundError as error:
        parser.error(str(error))
    exact = file_of(make())
    shipped = load_vessel("otter")
    files = {
        "author's figures": exact,
        "shipped Otter": exact.model_copy(update={"hull": shipped.hull, "thruster": shipped.thruster}),
    }
    if arguments.trial:
        judge_trial(exact, files["shipped Otter"], functools.partial(ForeignOtter, make=make), arguments.seed)
        return 0
    for told, belief in files.items():
        for name, water in WATERS.items():
            plant = functools.partial(ForeignOtter, make=make)
            case = Case(exact, water, belief=belief, seed=arguments.seed, source=SensedState, plant=plant)
            _tell(f"{told}, {name}", case)
    return 0


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
        hull.place(surge_mps=mps)
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


def _tell(what: str, case: Case) -> None:
    legs, _ = cells.legs(case, 1.5)
    ring = cells.ring(case, 20.0, 1.5)
    whole = cells.big_square(case, 1.5).whole
    wind = WaterConfig(wind_mps=case.water.wind_mps, current_mps=case.water.current_mps)
    still = held(replace(case, water=wind), seconds=200.0)
    print(
        f"{what:40} legs {legs.rms:.3f} m RMS, circle R20 {ring.rms:.3f}, corners {whole.rms:.3f} (most {whole.most:.1f}), "
        f"held {still.rms_m:.3f} (most {still.most_m:.2f}, swept {still.swept_deg:.0f} deg)",
        flush=True,
    )


if __name__ == "__main__":
    raise SystemExit(main())

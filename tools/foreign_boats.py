"""Boats of Fossen's Python Vehicle Simulator, from a checkout of it, in the place of our simulated hull: its Otter in six degrees of
freedom, and its tanker (van Berlekom and Goddard 1972) made as small as a boat. Nothing of them is ours but the wind, which both
lack, and the tanker's servo and shaft.
"""

from __future__ import annotations

import importlib
import math
import sys
import types
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from companion.core.hull import VesselConfig
from mavlink_bridge.language.units import wrap_pi
from sitl.plant import SimVessel
from sitl.plant.library import load_vessel
from sitl.plant.water import STILL, Conditions

_PACKAGE: Final = "python_vehicle_simulator"
Plant = Callable[[VesselConfig], SimVessel]


def boat_of(checkout: Path, name: str) -> Callable[[], Any]:
    """Return the class of a foreign boat; its packages' own imports (animations, plots) are left out.

    Raises ``FileNotFoundError`` where the checkout has none.
    """
    root = checkout / "src" / _PACKAGE
    if not (root / "vehicles" / f"{name}.py").exists():
        raise FileNotFoundError(f"{root}/vehicles/{name}.py: not a checkout of PythonVehicleSimulator")
    for package_name, folder in (
        (_PACKAGE, root),
        (f"{_PACKAGE}.lib", root / "lib"),
        (f"{_PACKAGE}.vehicles", root / "vehicles"),
    ):
        package = types.ModuleType(package_name)
        package.__path__ = [str(folder)]
        sys.modules[package_name] = package
    make: Callable[[], Any] = getattr(importlib.import_module(f"{_PACKAGE}.vehicles.{name}"), name)
    return make


def file_of_otter(otter: Any) -> VesselConfig:
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


_LENGTH_M, _TOP_MPS = 4.0, 3.0
"""Of the boat that the tanker is made: lengths shrink by 76, speeds by less than three, so that it is a boat's speed on a boat's length."""
_SHIP_M, _SHIP_MPS = 304.8, 9.2
"""Length of the tanker, and its speed at full revolutions."""
_FULL_RPM: Final = 90.0
_SHIP_M3: Final = 220_000.0
"""What it displaces."""
_SMALLER, _SLOWER = _LENGTH_M / _SHIP_M, _TOP_MPS / _SHIP_MPS
_QUICKER: Final = _SLOWER / _SMALLER
_LEFT: Final = 0.78
"""Of its thrust, after what the screw draws off the hull. This and the next: figures of ``tanker.py``, which keeps them to itself."""
_TUN, _TNN = 0.00063, 3.54e-5
"""Thrust that the way takes, and that of the screw at rest."""
_DRAG: Final = 0.0377 + _LEFT * 0.00695
"""Of the hull, and what its way takes off the screw."""
_CUN, _CNN = 0.605, 38.2
"""Flow at the rudder, squared: by way and revolutions, and by revolutions alone."""
_DEPTH_M: Final = 200.0
"""Of the tanker's water: deep."""
_SHAFT_S: Final = 0.3
_LEAST_U: Final = 0.05
"""m/s of the tanker: of sideslip it knows no angle at rest."""
_SOME_DRAG: Final = 1.0
"""N/(m/s): its drag is all quadratic, and a file with no other would have it coast for ever; 1.5 N at a speed that takes 14."""
_MASS_KG: Final = 1025.0 * _SHIP_M3 * _SMALLER**3


def file_of_tanker(tanker: Any) -> VesselConfig:
    """Return the vessel file of the tanker's published derivatives, as far as a file has a place for them, at 1.5 m/s.

    They are of the ship with its rudder amidships; in a file the rudder stands for itself, so what it damps is taken off.
    """
    m, length, mps = _MASS_KG, _LENGTH_M, 1.5
    thrust_n = _LEFT * m * _SHIP_M * _TNN * (_FULL_RPM / 60.0) ** 2 * _SLOWER * _QUICKER
    loss = _TUN / (_SHIP_M * _TNN * _FULL_RPM / 60.0) / _SLOWER
    x_m, xuu = -0.47 * length, _DRAG * m / length
    # the rudder's moment at rest with all thrust, and at this speed with the thrust that holds it, as lift * (2 u^2 + race * thrust)
    hold_n = xuu * mps**2
    at_rest, under_way = (
        0.098 * m * _SLOWER**2 * (_CUN * u * n + _CNN * n * n) / -x_m
        for u, n in ((0.0, _FULL_RPM / 60.0), (mps / _SLOWER, _rps(mps / _SLOWER)))
    )
    lift = (under_way - at_rest * hold_n / thrust_n) / (2.0 * mps**2)
    race_per_n = at_rest / lift / thrust_n
    fin = 2.0 * lift * math.sqrt(mps**2 + 0.5 * race_per_n * hold_n)
    hull = {
        "length_m": length,
        "beam_m": 0.62,
        "draught_m": tanker.T * _SMALLER,
        "mass_kg": m,
        "m11_kg": 1.05 * m,
        "m22_kg": 2.02 * m,
        "m23_kgm": 0.0,
        "m33_kgm2": 0.1232 * m * length**2,
        "xu": _SOME_DRAG,
        "xuu": xuu,
        "yv": max(0.0, 1.205 * m / length * mps - fin),
        "yvv": 2.4 * m / length,
        "nr": 0.0,
        "nrr": 0.0,
        "nur": max(0.0, 0.231 * m * length - x_m**2 * fin / mps),
        "munk": min(1.0, (0.451 * m - x_m * fin / mps) / ((2.02 - 1.05) * m)),
    }
    thruster = {"count": 1, "lateral_m": 0.0, "ahead_n": thrust_n, "astern_n": thrust_n, "lag_s": _SHAFT_S}
    thruster |= {
        "dead_band": 0.0,
        "speed_loss": loss,
        "diameter_m": math.sqrt(2.0 * 0.8 * 8.0 / (math.pi * 1025.0 * race_per_n)),
    }
    rudder = {"count": 1, "x_m": x_m, "area_m2": 4.0 * lift / (1025.0 * 2.51), "lag_s": 0.1, "rate_dps": 60.0}
    parts = {"hull": hull, "thruster": thruster, "rudder": rudder, "windage": {"frontal_m2": 0.4, "lateral_m2": 1.2}}
    shipped = load_vessel("otter")
    return shipped.model_copy(
        update={"name": "tanker, 4 m"}
        | {name: getattr(shipped, name).model_copy(update=values) for name, values in parts.items()}
    )


def _rps(u_mps: float) -> float:
    """Revolutions of the tanker's screw, 1/s, that hold a speed: drag, thrust less what the hull takes of it, and that by the way."""
    a, b, c = _LEFT * _SHIP_M * _TNN, -_LEFT * _TUN * u_mps, -_DRAG * u_mps**2 / _SHIP_M
    return (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)


class ForeignTanker(SimVessel):
    """Moves as the tanker does, in its own lengths and times; what the sensors see is shrunk.

    Its rudder stands in the race of its screw, and astern of rest it is not valid: it knows no sideslip there, so no station is kept.
    """

    def __init__(self, config: VesselConfig, make: Callable[[], Any]) -> None:
        super().__init__(config)
        self._tanker = make()
        self._tanker.waterDdepth = _DEPTH_M

    def _sail(self, dt_s: float, water: Conditions) -> None:
        """Shaft and servo have moved; now the hull."""
        tanker, ship_s = self._tanker, dt_s * _QUICKER
        u, v, r = self.u_mps / _SLOWER, self.v_mps / _SLOWER, self.r_radps / _QUICKER
        u = math.copysign(max(_LEAST_U, abs(u)), u)
        tanker.n_c = self._shaft_rpm(u)
        nu, _ = tanker.dynamics(
            np.zeros(6), np.array([u, v, 0.0, 0.0, 0.0, r]), np.array([-self.rudder_rad[0]]), np.zeros(1), ship_s
        )
        hull = self.config.hull
        surge_n, sway_n, yaw_nm = self.weather(water, math.cos(self.psi_rad), math.sin(self.psi_rad))
        self.u_mps += float(nu[0] - u) * _SLOWER + surge_n / hull.m11_kg * dt_s
        self.v_mps += float(nu[1] - v) * _SLOWER + sway_n / hull.m22_kg * dt_s
        self.r_radps += float(nu[5] - r) * _QUICKER + yaw_nm / hull.m33_kgm2 * dt_s
        self.vn_mps, self.ve_mps = self.ground_velocity(water)
        self.north_m += self.vn_mps * dt_s
        self.east_m += self.ve_mps * dt_s
        self.psi_rad = wrap_pi(self.psi_rad + self.r_radps * dt_s)

    def _shaft_rpm(self, u_mps: float) -> float:
        """Of a screw that turns slowly against the way the model's race is the root of a negative number: it is taken to stand."""
        rpm = self.revs[0] * _FULL_RPM
        return 0.0 if (_CUN * u_mps + _CNN * rpm / 60.0) * rpm < 0.0 else rpm


def boats(checkout: Path) -> dict[str, tuple[VesselConfig, Plant]]:
    """Return file and plant of each foreign boat. Raises ``FileNotFoundError``."""
    otter, tanker = boat_of(checkout, "otter"), boat_of(checkout, "tanker")
    return {
        "otter": (file_of_otter(otter()), partial(ForeignOtter, make=otter)),
        "tanker": (file_of_tanker(tanker()), partial(ForeignTanker, make=tanker)),
    }

"""Hulls that ship with nobody's boat, for tests and the bench: what a law tuned on the default vessel has never seen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from companion.core.hull import VesselConfig
from sitl.plant.library import load_vessel


def bare(name: str, munk: float) -> VesselConfig:
    """Return a shipped hull without rudders and with this share of the ideal Munk moment."""
    vessel = load_vessel(name)
    hull = vessel.hull.model_copy(update={"munk": munk})
    return vessel.model_copy(update={"hull": hull, "rudder": vessel.rudder.model_copy(update={"count": 0})})


def _foreign(
    name: str,
    hull: dict[str, float],
    thruster: dict[str, float],
    *,
    rudder: dict[str, float],
    windage: tuple[float, float],
) -> VesselConfig:
    """Return the default vessel with these coefficients in place of its own; areas to the wind from ahead and abeam, m²."""
    otter = load_vessel("otter")
    return otter.model_copy(
        update={
            "name": name,
            "hull": otter.hull.model_copy(update=hull),
            "thruster": otter.thruster.model_copy(update=thruster),
            "rudder": otter.rudder.model_copy(update=rudder),
            "windage": otter.windage.model_copy(update={"frontal_m2": windage[0], "lateral_m2": windage[1]}),
        }
    )


def launch() -> VesselConfig:
    """Return a twin-screw launch of 350 kg and 4 m whose propellers take 0.8 s and whose big rudders steer it."""
    size = {"length_m": 4.0, "beam_m": 1.6, "draught_m": 0.35, "mass_kg": 350.0}
    inertia = {"m11_kg": 375.0, "m22_kg": 640.0, "m23_kgm": 0.0, "m33_kgm2": 560.0}
    damping = {"xu": 40.0, "xuu": 60.0, "yv": 400.0, "yvv": 900.0, "nr": 450.0, "nrr": 2500.0, "munk": 0.6}
    thruster = {"lateral_m": 0.45, "ahead_n": 330.0, "astern_n": 200.0, "lag_s": 0.8, "diameter_m": 0.3}
    rudder = {"area_m2": 0.045, "x_m": -1.8, "rate_dps": 45.0, "lag_s": 0.15}
    return _foreign("launch", size | inertia | damping, thruster, rudder=rudder, windage=(1.3, 2.6))


def single_screw() -> VesselConfig:
    """Return a boat of 140 kg and 2.6 m with one propeller and one rudder behind it: it turns with way or race only."""
    size = {"length_m": 2.6, "beam_m": 0.9, "draught_m": 0.25, "mass_kg": 140.0}
    inertia = {"m11_kg": 150.0, "m22_kg": 270.0, "m23_kgm": 8.0, "m33_kgm2": 95.0}
    damping = {"xu": 22.0, "xuu": 22.0, "yv": 250.0, "yvv": 320.0, "nr": 95.0, "nrr": 500.0, "munk": 0.45}
    thruster = {"count": 1, "lateral_m": 0.0, "ahead_n": 180.0, "astern_n": 100.0, "lag_s": 0.35, "diameter_m": 0.22}
    rudder = {"count": 1, "area_m2": 0.03, "x_m": -1.2, "lag_s": 0.12}
    return _foreign("single screw", size | inertia | damping, thruster, rudder=rudder, windage=(0.5, 1.0))


def rudderless() -> VesselConfig:
    """Return a catamaran of 150 kg and 3 m that only its two propellers turn."""
    size = {"length_m": 3.0, "beam_m": 1.5, "draught_m": 0.22, "mass_kg": 150.0}
    inertia = {"m11_kg": 160.0, "m22_kg": 290.0, "m23_kgm": 10.0, "m33_kgm2": 150.0}
    damping = {"xu": 30.0, "xuu": 28.0, "yv": 260.0, "yvv": 340.0, "nr": 140.0, "nrr": 900.0, "munk": 0.5}
    thruster = {
        "lateral_m": 0.6,
        "ahead_n": 150.0,
        "astern_n": 95.0,
        "lag_s": 0.25,
        "dead_band": 0.05,
        "diameter_m": 0.2,
    }
    return _foreign("rudderless", size | inertia | damping, thruster, rudder={"count": 0}, windage=(0.7, 1.2))


def crooked() -> VesselConfig:
    """Return a boat of 90 kg whose rudders stand 4° off and whose propellers start at 12 %; it is met with ``late_eyes``."""
    size = {"length_m": 2.2, "beam_m": 1.0, "draught_m": 0.2, "mass_kg": 90.0}
    inertia = {"m11_kg": 97.0, "m22_kg": 175.0, "m23_kgm": 6.0, "m33_kgm2": 50.0}
    damping = {"xu": 20.0, "xuu": 20.0, "yv": 170.0, "yvv": 230.0, "nr": 55.0, "nrr": 400.0, "munk": 0.4}
    thruster = {"lateral_m": 0.4, "ahead_n": 110.0, "astern_n": 70.0, "dead_band": 0.12}
    rudder = {"area_m2": 0.012, "offset_deg": 4.0}
    return _foreign("crooked", size | inertia | damping, thruster, rudder=rudder, windage=(0.45, 0.8))


def lopsided() -> VesselConfig:
    """Return a boat of 110 kg whose starboard propeller gives a fifth less than the port one."""
    size = {"length_m": 2.4, "beam_m": 1.2, "draught_m": 0.2, "mass_kg": 110.0}
    inertia = {"m11_kg": 118.0, "m22_kg": 215.0, "m23_kgm": 8.0, "m33_kgm2": 75.0}
    damping = {"xu": 24.0, "xuu": 22.0, "yv": 200.0, "yvv": 260.0, "nr": 70.0, "nrr": 600.0, "munk": 0.5}
    thruster = {"lateral_m": 0.45, "ahead_n": 130.0, "astern_n": 80.0, "lag_s": 0.2, "starboard_share": 0.8}
    return _foreign("lopsided", size | inertia | damping, thruster, rudder={"area_m2": 0.011}, windage=(0.5, 0.9))


def cockle() -> VesselConfig:
    """Return a boat of 8 kg and 1.1 m with one propeller and one rudder: a strong breeze is a great deal to it."""
    size = {"length_m": 1.1, "beam_m": 0.38, "draught_m": 0.125, "mass_kg": 7.8}
    inertia = {"m11_kg": 8.2, "m22_kg": 16.0, "m23_kgm": 0.12, "m33_kgm2": 0.7}
    damping = {"xu": 2.4, "xuu": 5.2, "yv": 20.0, "yvv": 57.0, "nr": 1.05, "nrr": 4.4, "munk": 0.26}
    thruster = {"count": 1, "lateral_m": 0.0, "ahead_n": 31.0, "astern_n": 16.0, "lag_s": 0.08, "diameter_m": 0.097}
    rudder = {"count": 1, "area_m2": 0.0095, "x_m": -0.48, "rate_dps": 46.0, "lag_s": 0.15}
    return _foreign("cockle", size | inertia | damping, thruster, rudder=rudder, windage=(0.115, 0.265))


def barge() -> VesselConfig:
    """Return a barge of 720 kg and 4 m with one propeller of 150 N and one small rudder: full helm takes her turn up in three seconds."""
    size = {"length_m": 4.0, "beam_m": 1.45, "draught_m": 0.24, "mass_kg": 720.0}
    inertia = {"m11_kg": 760.0, "m22_kg": 1380.0, "m23_kgm": 0.0, "m33_kgm2": 1260.0}
    damping = {"xu": 15.0, "xuu": 32.0, "yv": 290.0, "yvv": 740.0, "nr": 590.0, "nrr": 400.0, "nur": 280.0, "munk": 0.7}
    thruster = {"count": 1, "lateral_m": 0.0, "ahead_n": 150.0, "astern_n": 82.0, "lag_s": 0.6, "diameter_m": 0.26}
    rudder = {"count": 1, "area_m2": 0.02, "x_m": -1.9, "rate_dps": 40.0, "lag_s": 0.15}
    return _foreign("barge", size | inertia | damping, thruster, rudder=rudder, windage=(0.45, 1.0))


def pontoon() -> VesselConfig:
    """Return a work pontoon of 670 kg and 4.6 m whose two small propellers take more than two seconds to turn it."""
    size = {"length_m": 4.6, "beam_m": 1.5, "draught_m": 0.46, "mass_kg": 670.0}
    inertia = {"m11_kg": 710.0, "m22_kg": 1350.0, "m23_kgm": 0.0, "m33_kgm2": 1720.0}
    damping = {"xu": 25.0, "xuu": 38.0, "yv": 510.0, "yvv": 570.0, "nr": 890.0, "nrr": 900.0, "munk": 0.13}
    thruster = {"lateral_m": 0.53, "ahead_n": 196.0, "astern_n": 110.0, "lag_s": 0.55, "diameter_m": 0.32}
    return _foreign("pontoon", size | inertia | damping, thruster, rudder={"count": 0}, windage=(1.3, 4.4))


def trolling_cat() -> VesselConfig:
    """Return a catamaran of 75 kg and 2.4 m with two trolling motors: a breeze takes all the thrust that she has."""
    size = {"length_m": 2.4, "beam_m": 1.2, "draught_m": 0.16, "mass_kg": 75.0}
    inertia = {"m11_kg": 79.5, "m22_kg": 209.0, "m23_kgm": 0.0, "m33_kgm2": 94.0}
    damping = {"xu": 3.2, "xuu": 54.0, "yv": 88.0, "yvv": 303.0, "nr": 4.8, "nrr": 151.0, "nur": 36.0, "munk": 0.68}
    thruster = {"lateral_m": 0.45, "ahead_n": 60.0, "astern_n": 33.0, "dead_band": 0.08, "lag_s": 0.38, "exponent": 2.1}
    return _foreign("trolling catamaran", size | inertia | damping, thruster, rudder={"count": 0}, windage=(0.5, 0.9))


FOREIGN: Final[dict[str, Callable[[], VesselConfig]]] = {
    "launch": launch,
    "single": single_screw,
    "rudderless": rudderless,
    "crooked": crooked,
    "lopsided": lopsided,
}
"""The five that no law or fit was made on, by name."""


def any_hull(name: str) -> VesselConfig:
    """Return one of ``FOREIGN``, or a shipped hull."""
    return FOREIGN[name]() if name in FOREIGN else load_vessel(name)

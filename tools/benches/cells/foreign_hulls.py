"""Hulls that ship with nobody's boat, for tests and the bench: what a law tuned on the default vessel has never seen."""

from __future__ import annotations

from companion.core.hull import VesselConfig
from sitl.plant.library import load_vessel


def bare(name: str, munk: float) -> VesselConfig:
    """Return a shipped hull without rudders and with this share of the ideal Munk moment."""
    vessel = load_vessel(name)
    hull = vessel.hull.model_copy(update={"munk": munk})
    return vessel.model_copy(update={"hull": hull, "rudder": vessel.rudder.model_copy(update={"count": 0})})


def launch() -> VesselConfig:
    """Return a twin-screw launch of 350 kg and 4 m whose propellers take 0.8 s and whose big rudders steer it."""
    otter = load_vessel("otter")
    hull = {
        "length_m": 4.0,
        "beam_m": 1.6,
        "draught_m": 0.35,
        "mass_kg": 350.0,
        "m11_kg": 375.0,
        "m22_kg": 640.0,
        "m23_kgm": 0.0,
        "m33_kgm2": 560.0,
        "xu": 40.0,
        "xuu": 60.0,
        "yv": 400.0,
        "yvv": 900.0,
        "nr": 450.0,
        "nrr": 2500.0,
        "munk": 0.6,
    }
    thruster = {"lateral_m": 0.45, "ahead_n": 330.0, "astern_n": 200.0, "lag_s": 0.8, "diameter_m": 0.3}
    rudder = {"area_m2": 0.045, "x_m": -1.8, "rate_dps": 45.0, "lag_s": 0.15}
    windage = {"frontal_m2": 1.3, "lateral_m2": 2.6}
    return otter.model_copy(
        update={
            "name": "launch",
            "hull": otter.hull.model_copy(update=hull),
            "thruster": otter.thruster.model_copy(update=thruster),
            "rudder": otter.rudder.model_copy(update=rudder),
            "windage": otter.windage.model_copy(update=windage),
        }
    )

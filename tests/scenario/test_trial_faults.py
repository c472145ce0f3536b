"""Sea trials in which something fails: whatever it is, the boat stays inside its area and above the guard, and stops in time."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

import pytest

from tests.world_station import Helm

SEA_TRIAL, ARM, SET_MODE = 31012, 400, 176
HOLD = 4.0
GUARD_M = 3.0
"""Least water under the keel less the margin, as set below."""
END, BEGIN, CONFIRM = 0.0, 1.0, 2.0
FENCE_POLYGON_IN = 5001
WIDE_M = 37.0
"""With less on one side a trial may be refused: it needs 25 m, looks in steps of up to 5 m, and ends 7 m from the edge."""
FAULTS = ("station", "shoal", "fence", "gnss", "heading", "thruster", "stop", "hold", "disarm")
GCS_S, STALE_S = 5.0, 2.0
"""The station's time-out, and the age at which a position or heading is no longer believed, with the tick that acts on it."""


@dataclass
class Sailed:
    """A trial, watched from outside: truth and pins."""

    helm: Helm
    radius_m: float
    polygon: list[tuple[float, float]]
    least_altitude_m: float = math.inf
    furthest_m: float = 0.0
    least_room_m: float = math.inf

    def watch(self, seconds: float, until=lambda: False) -> float:
        """Sail on; return the seconds that went by."""
        for k in range(round(20 * seconds)):
            if until():
                return k / 20.0
            self.helm.step()
            truth = self.helm.truth
            self.least_altitude_m = min(self.least_altitude_m, truth.depth_m - 0.35)
            self.furthest_m = max(self.furthest_m, math.hypot(truth.north_m, truth.east_m))
            if self.polygon:
                self.least_room_m = min(self.least_room_m, room_m((truth.north_m, truth.east_m), self.polygon))
        return seconds

    @property
    def ended(self) -> bool:
        return "Trial ended" in self.helm.texts()

    @property
    def neutral(self) -> bool:
        return all(abs(pulse - 1500.0) < 10.0 for pulse in self.helm.pulses_us)


def room_m(point: tuple[float, float], polygon: list[tuple[float, float]]) -> float:
    """Way to the nearest edge of a convex polygon, corners given clockwise; negative outside."""
    sides = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return min(
        ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0])) / math.dist(a, b) for a, b in sides
    )


def fence(helm: Helm, dice: random.Random) -> list[tuple[float, float]]:
    """Upload a fence of four corners about the start; return them."""
    polygon = [(dice.uniform(35, 60) * math.cos(a), dice.uniform(35, 60) * math.sin(a)) for a in (0.0, 1.6, 3.1, 4.7)]
    rows = [(0, FENCE_POLYGON_IN, float(len(polygon)), 0.0, 0.0, 0.0, *helm.at(*p), 0.0) for p in polygon]
    assert helm.upload(rows, kind=1) == 0
    return polygon


def begin(seed: int, fault: str) -> Sailed:
    dice = random.Random(f"trial {seed}")
    sea = [
        f"world.water.current_mps={dice.uniform(0.0, 0.4):.2f}",
        f"world.water.wind_mps={dice.uniform(0.0, 6.0):.1f}",
    ]
    sea += [
        f"world.water.current_to_deg={dice.uniform(0, 360):.0f}",
        f"world.water.wind_from_deg={dice.uniform(0, 360):.0f}",
    ]
    sea += ["world.bottom.mounds=[]"]
    if fault == "shoal":
        slope = {
            "bearing_deg": dice.uniform(0, 360),
            "start_m": dice.uniform(5, 15),
            "gradient": dice.uniform(0.15, 0.35),
        }
        sea += [f"world.bottom.slope.{key}={value:.2f}" for key, value in slope.items()]
        sea += ["world.bottom.depth_m=8", "depth.minimum_margin_m=1.0", "depth.good_margin_m=0.3"]
    else:
        sea += ["depth.enabled=false"]
    helm = Helm("ardurover", *sea, seed=seed)
    radius_m, polygon = dice.uniform(45.0, 100.0), []
    if fault == "fence":
        polygon = fence(helm, dice)
    assert helm.command(ARM, 1.0) == 0
    fitted = 1.0 if fault == "fence" else 0.0
    while helm.command(SEA_TRIAL, BEGIN, radius_m, 1.0, fitted) != 0:
        assert polygon, helm.texts()
        assert room_m((0.0, 0.0), polygon) < WIDE_M  # rightly refused; another place, then
        polygon = fence(helm, dice)
    assert helm.command(SEA_TRIAL, CONFIRM) == 0
    return Sailed(helm, radius_m, polygon)


def suffer(trial: Sailed, fault: str, seed: int) -> None:
    """Let it happen, and hold the boat to the time that it has."""
    helm, sensors = trial.helm, trial.helm.world.surroundings.plant.sensors.faults
    if fault == "station":
        helm.present = False
        assert trial.watch(GCS_S + 1.2, until=lambda: trial.ended) <= GCS_S + 1.1
        trial.watch(30.0)
        helm.present = True
    elif fault in ("gnss", "heading"):
        sensors.set(f"{fault}_silent", True)
        if fault == "heading":
            sensors.set("rate_silent", True)
        assert trial.watch(STALE_S + 0.5, until=lambda: trial.ended and trial.neutral) <= STALE_S + 0.3
        trial.watch(10.0)
        sensors.set(f"{fault}_silent", False)
        sensors.set("rate_silent", False)
    elif fault == "thruster":
        helm.world.surroundings.plant.vessel.thruster_health[seed % 2] = 0.0
    elif fault == "stop":
        assert helm.command(SEA_TRIAL, END) == 0
        assert trial.ended
    elif fault == "hold":
        assert helm.command(SET_MODE, 1.0, HOLD) == 0
        assert trial.ended
    elif fault == "disarm":
        assert helm.command(ARM, 0.0) == 0
        assert trial.watch(0.5, until=lambda: trial.neutral) <= 0.3


def sail(seed: int, fault: str, longest_s: float = 300.0) -> Sailed:
    trial = begin(seed, fault)
    trial.watch(random.Random(f"when {seed}").uniform(5.0, longest_s), until=lambda: trial.ended)
    if not trial.ended:
        suffer(trial, fault, seed)
    # disarmed, without a position, or stopped by the guard the thrusters are neutral by design: she drifts until an order comes
    trial.watch(
        240.0 if fault not in ("disarm", "gnss", "heading") else 5.0, until=lambda: fault == "shoal" and trial.ended
    )
    if fault == "shoal":
        trial.watch(5.0)
    return trial


def harm(trial: Sailed, fault: str) -> list[str]:
    """What must not happen on a trial, and did."""
    found = [] if trial.furthest_m < trial.radius_m else [f"{trial.furthest_m:.1f} m of {trial.radius_m:.0f} m"]
    if fault == "fence" and not (trial.least_room_m > 0.0 and "Outside the fence" not in trial.helm.texts()):
        found.append(f"outside the fence, room {trial.least_room_m:.1f} m")
    if fault == "shoal" and not trial.least_altitude_m > GUARD_M:
        found.append(f"{trial.least_altitude_m:.2f} m under the keel")
    return found


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(200))
def test_two_hundred_trials_in_which_something_fails(seed: int) -> None:
    fault = FAULTS[seed % len(FAULTS)]
    assert harm(sail(seed, fault), fault) == []

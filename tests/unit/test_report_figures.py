"""Figures of a report that a noisy sensor must not make: the way sailed, the least depth."""

from __future__ import annotations

import math
import random

from companion.report.flight import Flight, FlightTrack
from companion.report.verdicts import RunLimits, judge


def wobbling(**series):
    """A flight at rest whose positions jitter by decimetres."""
    draw, flight = random.Random(3), Flight("rest", "test")
    flight.tracks["estimate"] = FlightTrack()
    for tick in range(4000):
        flight.tracks["estimate"].add(tick * 0.1, 41.0 + draw.gauss(0, 1e-6), -8.0 + draw.gauss(0, 1e-6))
        for name, value in series.items():
            flight.of(name).add(tick * 0.1, value(tick, draw))
    return flight


def figure(flight, name):
    return next(verdict.value for verdict in judge(flight, RunLimits()) if verdict.name == name)


def test_a_vessel_at_rest_has_sailed_nothing():
    assert figure(wobbling(), "Distance sailed") != "0 m"  # nothing else is known
    assert figure(wobbling(sog_mps=lambda tick, draw: abs(draw.gauss(0, 0.03))), "Distance sailed") == "0 m"
    assert figure(wobbling(speed_mps=lambda tick, draw: 1.5 if tick < 1000 else math.nan), "Distance sailed") == "150 m"
    still = wobbling(sog_mps=lambda tick, draw: 1.5)
    still.tracks["truth"] = FlightTrack([0.0, 100.0], [41.0, 41.0], [-8.0, -8.0])
    assert figure(still, "Distance sailed") == "0 m"


def test_a_double_echo_is_no_least_depth():
    deep = wobbling(depth_m=lambda tick, draw: 5.95 if 100 <= tick < 120 else 19.8)
    assert figure(deep, "Least depth") == "19.80 m"
    shoal = wobbling(depth_m=lambda tick, draw: 4.2 if 100 <= tick < 160 else 19.8)
    assert figure(shoal, "Least depth") == "4.20 m"

"""Boats drawn at random that could float: what a law made on a dozen known hulls has never seen.

Each figure is drawn within what boats of that size have, from the scales of naval architecture: displacement from the box and its
block coefficient, speed from Froude's number, damping from how long the hull coasts, slips and turns.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import Final, Literal

from companion.core.hull import VesselConfig
from companion.core.hull.vessel_file import (
    RHO_WATER,
    HullConfig,
    RudderConfig,
    SeakeepingConfig,
    ThrusterConfig,
    WindageConfig,
)

_G_MPS2: Final = 9.81
_WAVE: Final = 0.16
"""Turning moment of a metre of waves over mass and length, as on the default hull; longer hulls lie across two of them."""

Kind = Literal["small", "heavy", "fast"]


@dataclass(frozen=True, slots=True)
class _Kind:
    """Spans to draw from."""

    length_m: tuple[float, float]
    froude: tuple[float, float]
    """Top speed over the root of g times length: up to 0.5 a hull that displaces, from 0.8 one that planes."""
    coasts_s: tuple[float, float]
    """Momentum at top speed over the drag there."""


_KINDS: Final[dict[Kind, _Kind]] = {
    "small": _Kind(length_m=(0.9, 3.0), froude=(0.3, 0.55), coasts_s=(1.5, 5.0)),
    "heavy": _Kind(length_m=(3.0, 6.0), froude=(0.22, 0.4), coasts_s=(5.0, 15.0)),
    "fast": _Kind(length_m=(1.0, 3.0), froude=(0.7, 1.3), coasts_s=(1.5, 4.0)),
}
KINDS: Final = tuple(_KINDS)
_LAYOUTS: Final[tuple[tuple[Literal[1, 2], Literal[0, 1, 2]], ...]] = ((2, 0), (2, 2), (1, 1))
"""Screws and rudders."""


def drawn(kind: Kind, seed: int) -> VesselConfig:
    """Return the boat of a kind and seed: twin propellers, the same with rudders, or one propeller and one rudder, in turns."""
    chance = random.Random(f"{kind} {seed}")
    spans, between = _KINDS[kind], chance.uniform
    length_m = math.exp(between(*map(math.log, spans.length_m)))
    beam_m, draught_m = length_m * between(0.28, 0.5), length_m * between(0.05, 0.11)
    mass_kg = RHO_WATER * length_m * beam_m * draught_m * between(0.3, 0.6)
    hull = _hull(chance, spans, (length_m, beam_m, draught_m), mass_kg)
    top_mps = between(*spans.froude) * math.sqrt(_G_MPS2 * length_m)
    drag_n = hull.m11_kg * top_mps / between(*spans.coasts_s)
    screws, rudders = _LAYOUTS[seed % len(_LAYOUTS)]
    loss = between(0.0, 0.3) / top_mps
    ahead_n = drag_n / screws / (1.0 - loss * top_mps)
    thruster = ThrusterConfig(
        count=screws,
        lateral_m=0.0 if screws == 1 else beam_m * between(0.28, 0.46),
        ahead_n=ahead_n,
        astern_n=ahead_n * between(0.4, 0.8),
        lag_s=min(1.0, between(0.08, 0.2) * length_m),
        dead_band=between(0.0, 0.06),
        exponent=between(1.2, 2.2),
        speed_loss=loss,
        diameter_m=min(0.8 * draught_m, length_m * between(0.05, 0.1)),
    )
    rudder = RudderConfig(
        count=rudders,
        area_m2=length_m * draught_m * between(0.03, 0.06) / max(1, rudders),
        x_m=-length_m * between(0.42, 0.5),
        rate_dps=between(30.0, 90.0),
        lag_s=between(0.05, 0.2),
    )
    side_m2 = length_m * beam_m
    return VesselConfig(
        name=f"{kind} {seed}",
        hull=hull.model_copy(update={"xu": 0.5 * drag_n / top_mps, "xuu": 0.5 * drag_n / top_mps**2}),
        thruster=thruster,
        rudder=rudder,
        windage=WindageConfig(frontal_m2=side_m2 * between(0.08, 0.25), lateral_m2=side_m2 * between(0.15, 0.45)),
        seakeeping=SeakeepingConfig(yaw_nm_per_m=_WAVE * mass_kg * min(length_m, 2.0)),
        transducer_depth_m=0.5 * draught_m,
        keel_depth_m=1.5 * draught_m,
    )


def _hull(chance: random.Random, spans: _Kind, size_m: tuple[float, float, float], mass_kg: float) -> HullConfig:
    """Without the drag ahead, which the top speed gives."""
    between = chance.uniform
    length_m, beam_m, draught_m = size_m
    m22_kg = mass_kg * between(1.5, 2.2)
    m33_kgm2 = mass_kg * (length_m * between(0.26, 0.36)) ** 2
    cross = 0.5 * RHO_WATER * draught_m * between(0.6, 1.2)
    scale = math.sqrt(0.5 * length_m)
    slips_s, turns_s = scale * between(0.6, 3.0), scale * between(0.4, 1.5)
    return HullConfig(
        length_m=length_m,
        beam_m=beam_m,
        draught_m=draught_m,
        mass_kg=mass_kg,
        m11_kg=mass_kg * between(1.03, 1.1),
        m22_kg=m22_kg,
        m33_kgm2=m33_kgm2,
        xu=0.0,
        xuu=0.0,
        yv=m22_kg / slips_s,
        yvv=cross * length_m,
        nr=m33_kgm2 / turns_s,
        nrr=cross * length_m**4 / 32.0 * between(1.0, 4.0),
        munk=between(0.1, 1.0),
    )

"""What a configuration means beyond its single values: combinations that cannot be meant, and what a person should look at first.

Mistakes are refused by ``check`` and ``run`` alike; warnings are told by both, because the vessel starts and tries again.
"""

from __future__ import annotations

from .addresses import collisions
from .hulls import hull_mistakes
from .meaning import endpoint_mistakes, gain_mistakes, hull_meaning, vessel_meaning
from .places import file_mistakes
from .warnings import gateway_notes, gateway_place_mistakes, gateway_warnings, verdict, vessel_notes, vessel_warnings

__all__ = [
    "collisions",
    "endpoint_mistakes",
    "file_mistakes",
    "gain_mistakes",
    "gateway_notes",
    "gateway_place_mistakes",
    "gateway_warnings",
    "hull_meaning",
    "hull_mistakes",
    "verdict",
    "vessel_meaning",
    "vessel_notes",
    "vessel_warnings",
]

"""What a ground station can do with the vessel over one link: one service for each kind of dialogue, all with the same few methods."""

from __future__ import annotations

from .asking import Asking
from .brought import Brought
from .channel import Channel
from .keys import Keys
from .library import Library
from .ordering import Ordering
from .parameters import Parameters
from .planning import Planning
from .presence import Presence
from .questions import Questions
from .service import Service
from .steering import Steering

__all__ = [
    "Asking",
    "Brought",
    "Channel",
    "Keys",
    "Library",
    "Ordering",
    "Parameters",
    "Planning",
    "Presence",
    "Questions",
    "Service",
    "Steering",
]

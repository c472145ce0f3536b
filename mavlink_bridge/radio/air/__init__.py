"""What the air allows: airtime, the law's ledger, profiles, pacing, the module's own protocol."""

from __future__ import annotations

from .ledger import Ledger, Priority
from .pacing import AirClock
from .profile import RadioProfile

__all__ = ["AirClock", "Ledger", "Priority", "RadioProfile"]

"""AIS (ITU-R M.1371) as receivers hand it on: sentence bodies in, typed reports in SI units out."""

from __future__ import annotations

from .receiver import AisReceiver
from .reports import (
    AidToNavigation,
    AisReport,
    BaseStation,
    PositionReport,
    SafetyText,
    StaticReport,
)

__all__ = [
    "AidToNavigation",
    "AisReceiver",
    "AisReport",
    "BaseStation",
    "PositionReport",
    "SafetyText",
    "StaticReport",
]

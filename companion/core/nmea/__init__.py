"""NMEA 0183 as boats speak it: bytes of one line in, stamped measurements in SI units out."""

from __future__ import annotations

from .reader import NmeaConfig, NmeaReader
from .sentences import KINDS, kind_of

__all__ = ["KINDS", "NmeaConfig", "NmeaReader", "kind_of"]

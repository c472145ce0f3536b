"""When and what simulated vessels send: intervals of ITU-R M.1371, positions with a receiver's noise, latency, loss, the UTC second.

What reaches the boat are bytes. The truth stays here.
"""

from __future__ import annotations

import math
import random
from typing import Final

from pydantic import Field

from companion.core.config import Config
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.units import mps_to_knots

from . import encoder
from .target import Target

_STATIC_S: Final = 360.0
"""Types 5 and 24 (ITU-R M.1371 table 1)."""
_MOORED: Final = (1, 5, 6)
_JITTER: Final = 0.03
"""Slots are not to the second."""


class AisText(Config):
    """How the simulated receiver hears."""

    loss_share: float = Field(0.2, ge=0, le=1)
    """Reports that are not received."""
    latency_s: float = Field(1.0, ge=0, le=30)
    """Between a fix and its bytes."""
    position_m: float = Field(6.0, ge=0, le=100)
    """Noise of the others' positions, each axis."""
    speed_mps: float = Field(0.15, ge=0, le=5)
    """Noise of their speeds."""
    course_deg: float = Field(2.0, ge=0, le=90)
    """Noise of a course at 3 m/s and more; up to six times that when slower."""
    silent: bool = False
    """The receiver is off."""


def interval_s(ais: str, speed_mps: float, *, turning: bool, moored: bool) -> float:
    """The lawful interval of position reports (ITU-R M.1371 tables 1 and 2)."""
    knots = mps_to_knots(speed_mps)
    if ais == "B":
        return 180.0 if knots <= 2.0 else 30.0
    if moored and knots <= 3.0:
        return 180.0
    if knots <= 14.0:
        return 10.0 / 3.0 if turning else 10.0
    if knots <= 23.0:
        return 2.0 if turning else 6.0
    return 2.0


class Transmitter:
    """One vessel's transponder and the air between. ``due`` gives the bytes that the boat's receiver hands on now."""

    def __init__(self, target: Target, frame: LocalFrame, config: AisText, rng: random.Random) -> None:
        self._target, self._frame, self.config, self._rng = target, frame, config, rng
        self._next_s = rng.uniform(0.0, 5.0)
        self._static_s = rng.uniform(0.0, 3.0)
        self._waiting: list[tuple[float, bytes]] = []
        self._sequence = 0
        self.heard_s: list[float] = []
        """When position reports were received, s."""

    def due(self, now_s: float, utc_us: int) -> bytes:
        """``now_s``: simulated time; ``utc_us``: UTC of now."""
        text = self._target.text
        if text.ais == "none":
            return b""
        if now_s >= self._next_s:
            self._report(now_s, utc_us)
        if now_s >= self._static_s:
            self._static(now_s)
        if not self._waiting or self._waiting[0][0] > now_s:
            return b""
        ready = [data for at_s, data in self._waiting if at_s <= now_s]
        self._waiting = [item for item in self._waiting if item[0] > now_s]
        return b"".join(ready)

    def _report(self, now_s: float, utc_us: int) -> None:
        target, rng = self._target, self._rng
        text = target.text
        turning = bool(target.turning_radps)
        lawful = interval_s(text.ais, target.speed_mps, turning=turning, moored=text.status in _MOORED)
        self._next_s = now_s + (text.interval_s or lawful) * rng.uniform(1.0 - _JITTER, 1.0 + _JITTER)
        data = self._position(utc_us)
        lost = rng.random() < self.config.loss_share
        arrives_s = now_s + self.config.latency_s
        if lost or self.config.silent or any(each.from_s <= now_s <= each.to_s for each in text.silent):
            return
        self.heard_s.append(arrives_s)
        self._waiting.append((arrives_s, data))

    def _position(self, utc_us: int) -> bytes:
        target, rng, config = self._target, self._rng, self.config
        text, speed = target.text, target.speed_mps
        north = target.north_m + rng.gauss(0.0, 1.0) * config.position_m
        east = target.east_m + rng.gauss(0.0, 1.0) * config.position_m
        lat_rad, lon_rad = self._frame.to_geodetic(north, east)
        report = encoder.StationReport(target.mmsi, lat_rad, lon_rad, utc_us // 1_000_000 % 60)
        report.sog_mps = max(0.0, speed + rng.gauss(0.0, 1.0) * config.speed_mps * (speed > 0.0 or 0.5))
        worse = min(max(3.0 / max(speed, 0.3), 1.0), 6.0)
        report.cog_rad = target.course_rad + rng.gauss(0.0, 1.0) * math.radians(config.course_deg) * worse
        report.heading_rad = target.course_rad if text.has_heading else None
        report.turn_radps = target.turning_radps if text.has_heading else None
        report.status = text.status
        self._sequence = (self._sequence + 1) % 10
        return encoder.sentences(report.class_b() if text.ais == "B" else report.class_a(), self._sequence)

    def _static(self, now_s: float) -> None:
        text, mmsi = self._target.text, self._target.mmsi
        first = self._static_s < _STATIC_S  # she was there before: her name is known
        self._static_s = now_s + _STATIC_S
        name = text.name or f"VESSEL {mmsi % 1000}"
        messages = (
            encoder.static_b(mmsi, name, text.ship_type, text.length_m, text.width_m)
            if text.ais == "B"
            else (encoder.static_a(mmsi, name, text.ship_type, text.length_m, text.width_m),)
        )
        for fields in messages:
            self._sequence = (self._sequence + 1) % 10
            heard = first or self._rng.random() >= self.config.loss_share
            if heard and not self.config.silent:
                self._waiting.append((now_s, encoder.sentences(fields, self._sequence)))

"""Airtime of the vessel's radio from the recorded writes: each, at the modulation of the run's radio profile."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from mavlink_bridge.radio.air.airtime import write_us
from mavlink_bridge.radio.air.ledger import HOUR_US

from ..io.recording.inputs import InputStep
from ..radio import load_radio
from ..settings import ConfigError
from .flight import Flight


class Airtime:
    """Adds the series ``airtime_hour_s`` to a flight while the recorded steps go by."""

    def __init__(self, flight: Flight, meta: Mapping[str, Any]) -> None:
        self._flight = flight
        self._link: int | None = None
        self._spent: deque[tuple[int, int]] = deque()
        self._total_us = 0
        names = [link.get("name") for link in meta.get("links", [])]
        profile = str(flight.settings.get("radio", {}).get("profile", ""))
        if "radio" not in names or not profile:
            return
        try:
            self._profile = load_radio(profile)
        except ConfigError as error:
            flight.notes.append(f"airtime is not shown: {error}")
            return
        self._link = names.index("radio")
        limit_us = self._profile.hour_us
        flight.airtime_limit_s = None if limit_us is None else limit_us * 1e-6

    def take(self, step: InputStep) -> None:
        """Count what this step wrote to the radio."""
        if self._link is None:
            return
        for write in step.writes.get(self._link, ()):
            if write.accepted:
                self._add(step.now_us, write.accepted)

    def _add(self, now_us: int, size: int) -> None:
        spent_us = write_us(size, self._profile.modulation, self._profile.module_header_bytes)
        self._spent.append((now_us, spent_us))
        self._total_us += spent_us
        while self._spent[0][0] <= now_us - HOUR_US:
            self._total_us -= self._spent.popleft()[1]
        self._flight.of("airtime_hour_s").add(now_us * 1e-6, self._total_us * 1e-6)

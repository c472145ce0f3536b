"""What others bring the vessel over MAVLink: corrections for its receiver, the soundings of an echo sounder on another component."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from ...language.requests import DistanceInput
from .channel import Channel
from .rtcm import RtcmAssembler
from .service import Handler, Service

_DOWN: Final = 25
"""MAV_SENSOR_ROTATION_PITCH_270."""


class Brought(Service):
    """GPS_RTCM_DATA of any station, DISTANCE_SENSOR of the vessel's own system."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._rtcm = RtcmAssembler(channel.explain)

    @property
    def handles(self) -> Mapping[str, Handler]:
        return {"GPS_RTCM_DATA": self._on_corrections, "DISTANCE_SENSOR": self._on_distance}

    @property
    def refused(self) -> int:
        """Corrections that held no whole frame with a right CRC, so far."""
        return self._rtcm.refused

    def _on_corrections(self, message: Any, now_us: int) -> None:
        self._channel.stream(self._rtcm.receive(message), message.get_srcSystem())

    def _on_distance(self, message: Any, now_us: int) -> None:
        if message.get_srcSystem() == self._channel.config.system_id:
            self._channel.stream(distance(message), message.get_srcSystem())


def distance(message: Any) -> DistanceInput | None:
    """DISTANCE_SENSOR that looks down. Outside the sensor's own range there is no bottom: value None."""
    if message.orientation != _DOWN:
        return None
    in_range = message.min_distance <= message.current_distance <= message.max_distance
    quality = None if message.signal_quality == 0 else max(0.0, (message.signal_quality - 1) / 99.0)
    value_m = message.current_distance / 100.0 if in_range and message.signal_quality != 1 else None
    return DistanceInput(value_m, quality)

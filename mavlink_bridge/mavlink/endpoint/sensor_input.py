"""Measurements that reach the vessel over MAVLink: an echo sounder on another component, corrections for the GNSS receiver."""

from __future__ import annotations

from typing import Any, Final

from ...language.requests import DistanceInput, RtcmData

_DOWN: Final = 25
MAX_RTCM_PART: Final = 180


def distance(message: Any) -> DistanceInput | None:
    """DISTANCE_SENSOR that looks down. Outside the sensor's own range there is no bottom: value None."""
    if message.orientation != _DOWN:
        return None
    in_range = message.min_distance <= message.current_distance <= message.max_distance
    quality = None if message.signal_quality == 0 else max(0.0, (message.signal_quality - 1) / 99.0)
    value_m = message.current_distance / 100.0 if in_range and message.signal_quality != 1 else None
    return DistanceInput(value_m, quality)


class RtcmAssembler:
    """GPS_RTCM_DATA back to whole messages: up to four parts, numbered, of one 5-bit sequence (common.xml)."""

    def __init__(self) -> None:
        self._sequence = -1
        self._parts: dict[int, bytes] = {}
        self._last_part: int | None = None

    def receive(self, message: Any) -> RtcmData | None:
        """Take one message; return the whole data when it is complete."""
        data = bytes(message.data[: min(message.len, MAX_RTCM_PART)])
        if not message.flags & 1:
            return RtcmData(data) if data else None
        sequence, part = message.flags >> 3 & 0x1F, message.flags >> 1 & 3
        if sequence != self._sequence:
            self._sequence, self._parts, self._last_part = sequence, {}, None
        self._parts[part] = data
        if part == 3 or len(data) < MAX_RTCM_PART:
            self._last_part = part
        if self._last_part is None or any(number not in self._parts for number in range(self._last_part + 1)):
            return None
        whole = b"".join(self._parts[number] for number in range(self._last_part + 1))
        self._sequence, self._parts, self._last_part = -1, {}, None
        return RtcmData(whole)

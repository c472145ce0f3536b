"""What the vehicle says of itself over MAVLink: the newest of each message, when it came, and whether that is still now.

A vehicle behind a radio is told of by a gateway: its values are as old as the newest state that crossed the air, and the
gateway says how old that is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

STREAMS_HZ: Final[Mapping[str, float]] = {
    "GLOBAL_POSITION_INT": 5.0,
    "ATTITUDE": 5.0,
    "GPS_RAW_INT": 1.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 0.5,
    "NAV_CONTROLLER_OUTPUT": 1.0,
    "POSITION_TARGET_GLOBAL_INT": 1.0,
    "SERVO_OUTPUT_RAW": 1.0,
    "MISSION_CURRENT": 1.0,
    "DISTANCE_SENSOR": 1.0,
    "RANGEFINDER": 1.0,
    "SYSTEM_TIME": 0.5,
}
"""What an autopilot that streams nothing by itself is asked for."""
KEPT: Final = frozenset(
    (
        *STREAMS_HZ,
        "HEARTBEAT",
        "ALTITUDE",
        "HOME_POSITION",
        "WATER_DEPTH",
        "HIGH_LATENCY2",
        "ORBIT_EXECUTION_STATUS",
        "RPM",
        "ESC_TELEMETRY_1_TO_4",
        "RADIO_STATUS",
    )
)
"""Messages that are looked at; of each kind the newest is kept."""
FRESH_US: Final = 2_500_000
"""A stream that has missed two of its seconds says nothing of now."""
_RADIO_US: Final = 5_000_000
_RADIO_AGE: Final = "radio_age"
"""A gateway's NAMED_VALUE_FLOAT: s since the vessel was heard over the air; negative: never."""


@dataclass(frozen=True, slots=True)
class HeardMessage:
    """A message and when it came, by the bridge's clock."""

    message: Any
    at_us: int


class ImcPicture:
    """The newest of everything. Bounded by the kinds of messages."""

    def __init__(self) -> None:
        self._newest: dict[str, HeardMessage] = {}
        self._radio_age: HeardMessage | None = None

    def hear(self, message: Any, now_us: int) -> None:
        """Take in a decoded MAVLink message of the vehicle."""
        name = message.get_type()
        if name in KEPT:
            self._newest[name] = HeardMessage(message, now_us)
        elif name == "NAMED_VALUE_FLOAT" and message.name.rstrip("\0") == _RADIO_AGE:
            self._radio_age = HeardMessage(message.value, now_us)

    def newest(self, name: str) -> HeardMessage | None:
        """The newest message of a kind, however old."""
        return self._newest.get(name)

    def fresh(self, name: str, now_us: int, within_us: int = FRESH_US) -> Any | None:
        """The newest message of a kind, if it says something of now."""
        heard = self._newest.get(name)
        return heard.message if heard is not None and now_us - heard.at_us <= within_us else None

    def by_radio(self, now_us: int) -> bool:
        """Whether a radio lies between us and the vehicle."""
        gateway = self._radio_age is not None and now_us - self._radio_age.at_us <= _RADIO_US
        return gateway or self.fresh("HIGH_LATENCY2", now_us, 10 * _RADIO_US) is not None

    def age_s(self, now_us: int) -> float | None:
        """How old what the vehicle's streams say is beyond their own way here; None when nothing has crossed the air yet."""
        if self._radio_age is None or now_us - self._radio_age.at_us > _RADIO_US:
            return 0.0
        age_s = float(self._radio_age.message)
        return None if age_s < 0.0 else age_s + (now_us - self._radio_age.at_us) * 1e-6

    def heard_us(self) -> int | None:
        """When the vehicle's newest HEARTBEAT came."""
        heard = self._newest.get("HEARTBEAT")
        return None if heard is None else heard.at_us

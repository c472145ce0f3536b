"""What a station has heard of the vehicle: who it is, its mode, whether it is armed, where its plan stands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Final

from ...language.messages import Mode
from ..persona import modes
from ..persona.identity import VENDOR_ID

SAFETY_ARMED: Final = 128
"""MAV_MODE_FLAG_SAFETY_ARMED."""
_NO_ITEMS: Final = 0xFFFF
"""MISSION_CURRENT.total of a vehicle without a plan."""
_ARDUPILOT: Final = 3
_PX4: Final = 12
COMPLETE: Final = 5
"""MISSION_STATE_COMPLETE."""
RADIO_AGE: Final = "radio_age"
"""What only a gateway tells: how old its newest word of the vessel is."""


class Autopilot(Enum):
    """Whose rules count: mode numbers, the home item, which plan items it sails."""

    OURS = "this software"
    ARDUPILOT = "ArduPilot"
    PX4 = "PX4"
    OTHER = "another autopilot"


@dataclass(frozen=True, slots=True)
class HeardVehicle:
    """The vehicle as heard. None = not heard yet."""

    system: int
    component: int = 1
    autopilot: int = 0
    """MAV_AUTOPILOT."""
    vendor: int | None = None
    """AUTOPILOT_VERSION.vendor_id; None until it has answered."""
    custom_mode: int = 0
    armed: bool = False
    mission_seq: int = 0
    """As this vehicle counts; with a home item it is one more than ours."""
    mission_total: int = 0
    mission_state: int = 0
    """MISSION_STATE, 0 = it does not say."""
    mission_id: int = 0
    """CRC-32 of the plan in force, 0 = it does not say."""
    reached: int | None = None
    """Newest MISSION_ITEM_REACHED."""
    by_radio: bool = False
    """A gateway speaks for it: what has to be repeated many times a second does not cross."""

    @property
    def kind(self) -> Autopilot:
        if self.vendor == VENDOR_ID:
            return Autopilot.OURS
        if self.autopilot == _ARDUPILOT:
            return Autopilot.ARDUPILOT
        return Autopilot.PX4 if self.autopilot == _PX4 else Autopilot.OTHER

    @property
    def home_item(self) -> bool:
        """Whether its item 0 is home, as ArduPilot counts."""
        return self.autopilot == _ARDUPILOT

    @property
    def mode(self) -> Mode | None:
        """None for a mode that this boat has not."""
        return modes.from_custom_mode(self.custom_mode)

    @property
    def item(self) -> int:
        """The current item in canonical numbers, from 0."""
        return max(self.mission_seq - int(self.home_item), 0)

    def numbers_of(self, mode: Mode) -> tuple[float, float]:
        """Parameters 2 and 3 of MAV_CMD_DO_SET_MODE in this vehicle's numbers."""
        face = modes.face(mode)
        if self.autopilot == _ARDUPILOT:
            return float(face.rover), 0.0
        return float(face.px4 >> 16 & 0xFF), float(face.px4 >> 24)


def hear(vehicle: HeardVehicle, message: Any) -> HeardVehicle:
    """The vehicle after one of its messages."""
    match message.get_type():
        case "HEARTBEAT":
            armed = bool(message.base_mode & SAFETY_ARMED)
            return replace(vehicle, autopilot=message.autopilot, custom_mode=message.custom_mode, armed=armed)
        case "AUTOPILOT_VERSION":
            return replace(vehicle, vendor=message.vendor_id)
        case "MISSION_CURRENT":
            return replace(
                vehicle,
                mission_seq=message.seq,
                mission_total=0 if message.total == _NO_ITEMS else message.total,
                mission_state=message.mission_state,
                mission_id=getattr(message, "mission_id", 0),
            )
        case "NAMED_VALUE_FLOAT":
            return replace(vehicle, by_radio=True) if message.name.rstrip("\0") == RADIO_AGE else vehicle
        case "MISSION_ITEM_REACHED":
            return replace(vehicle, reached=message.seq)
        case _:
            return vehicle

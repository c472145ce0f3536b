"""How one endpoint presents itself and how much it may say: persona, link class, telemetry rates, byte budget."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

Persona = Literal["ardurover", "generic"]
LinkClass = Literal["trusted", "signed", "telemetry"]
Profile = Literal["lan", "lora", "high_latency"]
GenericModes = Literal["px4", "rover"]


@dataclass(frozen=True, slots=True)
class Budget:
    """Byte budget of a link: never more than ``bytes_per_s`` over any 10 s, never more than ``burst_bytes`` at once."""

    bytes_per_s: float
    burst_bytes: int


LAN_RATES_HZ: Final[Mapping[str, float]] = {
    "ATTITUDE": 4.0,
    "GLOBAL_POSITION_INT": 4.0,
    "LOCAL_POSITION_NED": 2.0,
    "VFR_HUD": 2.0,
    "NAV_CONTROLLER_OUTPUT": 2.0,
    "POSITION_TARGET_GLOBAL_INT": 1.0,
    "ORBIT_EXECUTION_STATUS": 1.0,
    "FIGURE_EIGHT_EXECUTION_STATUS": 1.0,
    "GPS_RAW_INT": 1.0,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 0.5,
    "EXTENDED_SYS_STATE": 1.0,
    "HOME_POSITION": 0.5,
    "MISSION_CURRENT": 1.0,
    "CURRENT_MODE": 0.5,
    "FENCE_STATUS": 1.0,
    "SERVO_OUTPUT_RAW": 1.0,
    "DISTANCE_SENSOR": 2.0,
    "ALTITUDE": 1.0,
    "WATER_DEPTH": 1.0,
    "SYSTEM_TIME": 0.5,
}
"""What flows unasked on a local link (gcs.md check 54); a station may ask for more by SET_MESSAGE_INTERVAL."""

# One HEARTBEAT is half a second of air at 651 bit/s; what changes is sent when it changes.
LORA_RATES_HZ: Final[Mapping[str, float]] = {
    "GLOBAL_POSITION_INT": 0.1,
    "SYS_STATUS": 0.03,
    "MISSION_CURRENT": 0.05,
}

_RATES: Final[Mapping[Profile, Mapping[str, float]]] = {
    "lan": LAN_RATES_HZ,
    "lora": LORA_RATES_HZ,
    "high_latency": {},
}
_BUDGETS: Final[Mapping[Profile, Budget]] = {
    "lan": Budget(400_000.0, 64_000),
    "lora": Budget(60.0, 400),
    "high_latency": Budget(60.0, 400),
}


@dataclass(frozen=True)
class EndpointConfig:
    """One endpoint's settings. ``rates_hz`` and ``budget`` None take the profile's."""

    name: str = "gcs"
    persona: Persona = "ardurover"
    system_id: int = 1
    component_id: int = 1
    link_class: LinkClass = "trusted"
    profile: Profile = "lan"
    generic_mode_encoding: GenericModes = "px4"
    """Mode numbers of persona generic: PX4 layout, as MAVSDK reads them, or ArduPilot's Rover numbers, as MAVProxy does."""
    rates_hz: Mapping[str, float] | None = None
    budget: Budget | None = None
    max_rate_hz: float = 50.0
    """The fastest stream that SET_MESSAGE_INTERVAL may ask for."""
    high_latency_period_s: float = 30.0
    flood_frames_per_s: float = 2000.0
    """Frames a second accepted from one endpoint before the rest is dropped unread."""
    flood_burst_frames: int = 4000
    heartbeat_s: float | None = None
    """Between two HEARTBEATs; None takes the profile's."""
    give_up_s: float = 30.0
    """How long a command may wait for the vessel's answer before it is called failed."""

    def __post_init__(self) -> None:
        if not 1 <= self.system_id <= 255 or not 1 <= self.component_id <= 255:
            raise ValueError("system and component id must be 1...255")

    @property
    def rates(self) -> Mapping[str, float]:
        """Streams on from the start, message name to Hz."""
        return _RATES[self.profile] if self.rates_hz is None else self.rates_hz

    @property
    def heartbeat_us(self) -> int:
        """Period of HEARTBEAT; on a slow link just below the 3 s after which stations call it lost."""
        if self.heartbeat_s is not None:
            return round(self.heartbeat_s * 1e6)
        return 2_500_000 if self.profile == "lora" else 1_000_000

    @property
    def limits(self) -> Budget:
        return _BUDGETS[self.profile] if self.budget is None else self.budget

    @property
    def has_home_item(self) -> bool:
        """True when item 0 of a mission is the home position (ArduPilot's rule)."""
        return self.persona == "ardurover"

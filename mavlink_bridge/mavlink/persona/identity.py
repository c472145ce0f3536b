"""Who the vessel says it is: AUTOPILOT_VERSION with our own vendor id, and the text that tells the truth about the persona."""

from __future__ import annotations

from typing import Any, Final

from ..wire.codec import dialect
from .config import EndpointConfig
from .port import Identity

VENDOR_ID: Final = 0x5553
PRODUCT_ID: Final = 0x5631
"""Not registered anywhere: 'USV1'."""

_VERSION_TYPE_DEV: Final = 0

MISSION_INT: Final = 4
COMMAND_INT: Final = 8
FTP: Final = 32
SET_ATTITUDE_TARGET: Final = 64
SET_POSITION_TARGET_GLOBAL_INT: Final = 256
FLIGHT_TERMINATION: Final = 2048
MAVLINK2: Final = 8192
MISSION_FENCE: Final = 16384
MISSION_RALLY: Final = 32768
PARAM_ENCODE_BYTEWISE: Final = 16
PARAM_ENCODE_C_CAST: Final = 131072


def capabilities(config: EndpointConfig) -> int:
    """MAV_PROTOCOL_CAPABILITY: what is set is served, what is clear is refused. All parameters are REAL32, so both encodings are true."""
    encoding = PARAM_ENCODE_C_CAST if config.persona == "ardurover" else PARAM_ENCODE_BYTEWISE
    return (
        MISSION_INT
        | COMMAND_INT
        | FTP
        | SET_ATTITUDE_TARGET
        | SET_POSITION_TARGET_GLOBAL_INT
        | FLIGHT_TERMINATION
        | MAVLINK2
        | MISSION_FENCE
        | MISSION_RALLY
        | encoding
    )


def _version(numbers: tuple[int, int, int]) -> int:
    major, minor, patch = numbers
    return major << 24 | minor << 16 | patch << 8 | _VERSION_TYPE_DEV


def autopilot_version(identity: Identity, config: EndpointConfig) -> Any:
    """AUTOPILOT_VERSION, version type DEV so that no station compares it with another project's releases."""
    return dialect.MAVLink_autopilot_version_message(
        capabilities=capabilities(config),
        flight_sw_version=_version(identity.version),
        middleware_sw_version=0,
        os_sw_version=_version(identity.os_version),
        board_version=identity.board & 0xFFFFFFFF,
        flight_custom_version=list(identity.git_hash.encode("ascii", "replace")[:8].ljust(8, b"\0")),
        middleware_custom_version=[0] * 8,
        os_custom_version=[0] * 8,
        vendor_id=VENDOR_ID,
        product_id=PRODUCT_ID,
        uid=identity.uid & 0xFFFFFFFFFFFFFFFF,
    )


def greeting(identity: Identity, config: EndpointConfig) -> str:
    """The text each station gets once."""
    version = ".".join(str(number) for number in identity.version)
    if config.persona == "ardurover":
        return f"{identity.name} {version}: not ArduPilot, in its Rover dialect"
    return f"{identity.name} {version}"

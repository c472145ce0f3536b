"""Settings of the bridge: who it is among IMC systems, where it listens, and which vehicle it stands for."""

from __future__ import annotations

import ipaddress
from pathlib import Path
from typing import Final, Literal

from pydantic import Field

from mavlink_bridge.imc import SystemType

from ..core.config import Config
from ..io.links import LinkConfigError, check_link
from .desk_config import DeskConfig

OTTER: Final = ("otter", 0x0803)
"""Name and id of the vessel that every console of LSTS' knows."""
TYPES: Final = {
    "usv": SystemType.USV,
    "uuv": SystemType.UUV,
    "ugv": SystemType.UGV,
    "uav": SystemType.UAV,
    "mobile-sensor": SystemType.MOBILESENSOR,
}


class ImcSettings(Config):
    """The whole configuration of ``companion imc``."""

    vehicle: str = "tcp://127.0.0.1:5760"
    """The MAVLink vehicle or the radio gateway: tcp://, udp-listen://, udp://, serial:."""
    vehicle_id: int = Field(0, ge=0, le=255)
    """Its MAVLink system id; 0: the first that is heard."""
    key_file: str = ""
    """Signing key that vehicle and bridge share, made by 'companion keys'; empty: unsigned."""
    vessel_config: str = ""
    """The vessel's own configuration file: names, ranges and units of its parameters, and its rudders. Empty: the defaults."""
    vessel: str = ""
    """Its hull file, for the greatest speed: a plan that is faster is told so when it is saved. Empty: that of `vessel_config`, if any."""
    name: str = Field("usv-1", pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,30}$")
    """The system's name in the console; its files there are found by it."""
    imc_id: int = Field(0x2877, ge=1, le=0xFFEF)
    """The system's IMC id. 0x2800...0x2BFF is free for surface vessels that are not of LSTS."""
    type: Literal["usv", "uuv", "ugv", "uav", "mobile-sensor"] = "usv"
    """What the console shows it as."""
    listen: str = Field("127.0.0.1", pattern=r"^\d{1,3}(\.\d{1,3}){3}$")
    """Own address on which consoles are served: this computer alone, one of its addresses, or 0.0.0.0 for all."""
    insecure: bool = False
    """Needed to serve consoles on other computers: IMC proves nothing, so whoever can send commands the vessel."""
    udp_port: int = Field(6002, ge=1, le=65000)
    """Where consoles send to; the next free one of five."""
    tcp_port: int = Field(6002, ge=0, le=65000)
    """For consoles that send plans over a connection; 0: none."""
    state_hz: float = Field(2.0, ge=0.2, le=10.0)
    """EstimatedState per second."""
    rudder_full_deg: float = Field(30.0, gt=0.0, le=90.0)
    """The rudder's angle at full pulse, for SetServoPosition."""
    store: str = "state/imc.db"
    """Plans and the last commander outlive a restart here; empty: memory only."""
    desk: DeskConfig = DeskConfig()


def as_otter(settings: ImcSettings) -> ImcSettings:
    """The same under a name that the console has the files of."""
    return settings.model_copy(update={"name": OTTER[0], "imc_id": OTTER[1]})


def mistakes(settings: ImcSettings) -> list[str]:
    """What cannot be meant, though each value is of the right kind."""
    found = []
    try:
        check_link(settings.vehicle)
    except LinkConfigError as error:
        found.append(f"vehicle = {settings.vehicle!r}: {str(error).removeprefix(f'{settings.vehicle}: ')}")
    try:
        is_local = ipaddress.ip_address(settings.listen).is_loopback
    except ValueError:
        return [*found, f"listen = {settings.listen!r}: no address; give 127.0.0.1, one of this computer's, or 0.0.0.0"]
    if not is_local and not settings.insecure:
        found.append(
            f"listen = {settings.listen!r}: other computers can command the vessel there, and IMC proves nothing; set insecure = true,"
            " or listen on 127.0.0.1 and let them in by a tunnel"
        )
    for key in ("key_file", "vessel_config"):
        path = getattr(settings, key)
        if path and not Path(path).is_file():
            found.append(f"{key} = {path!r}: no such file")
    return found

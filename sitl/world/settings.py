"""Settings of the simulator: what the vessel's own settings do not know about the world around it."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from companion.core.config import Config
from companion.io.links import LinkConfigError, parse_link_url
from companion.settings import Settings

from ..plant import Motion, WaterConfig
from ..plant.bottom import BottomConfig
from ..radio import RadioConfig
from ..sensors import SimulatedSensors
from ..traffic import AisText, VesselText


class WorldConfig(Config):
    """The simulated surroundings."""

    latitude_deg: float = Field(41.1850123, ge=-89, le=89)
    """Where the vessel starts."""
    longitude_deg: float = Field(-8.7062154, ge=-180, le=180)
    """Where the vessel starts."""
    heading_deg: float = Field(0.0, ge=0, lt=360)
    """Which way it looks then."""
    step_us: int = Field(20_000, ge=1_000, le=50_000)
    """Step of the physics."""
    vessel: str = ""
    """The hull that is really there; empty = the one the vessel believes in."""
    arduino: Literal["twin", "firmware"] = "twin"
    """The actuator board: its Python twin, or the real AVR binary on a simulated chip."""
    sensors: SimulatedSensors = SimulatedSensors()
    water: WaterConfig = WaterConfig()
    bottom: BottomConfig = BottomConfig()
    radio: RadioConfig = RadioConfig()
    ais: AisText = AisText()
    moved: tuple[Motion, ...] = Field((), max_length=1000)
    """The hull is taken along this table of heading and speed, whatever its actuators do: t_s, heading_deg, speed_mps."""
    vessels: tuple[VesselText, ...] = Field((), max_length=256)
    """Other vessels; a scenario writes them as [[vessel]]."""

    @property
    def start_rad(self) -> tuple[float, float]:
        return math.radians(self.latitude_deg), math.radians(self.longitude_deg)


STATION_SPEED = 2.0
"""Faster than this a ground station's heartbeats, one a real second, are too far apart for the vessel's time-out of 5 s."""


class SimSettings(Settings):
    """The vessel's settings plus the world's."""

    world: WorldConfig = WorldConfig()


def on_this_computer(settings: SimSettings) -> SimSettings:
    """A boat's settings for the simulator: what hangs on its ports and its network is simulated on this computer.

    A serial device becomes a pty in the run's directory, named after the link, and a sensor's or board's address in a network
    becomes this computer's own. What is there already (``RUN_DIR``, 127.0.0.1) stays.
    """

    def place(name: str, url: str) -> str:
        try:
            link = parse_link_url(url)
            options = f"?{url.partition('?')[2]}" if "?" in url else ""
            if link.scheme == "serial" and not link.where.startswith("RUN_DIR/"):
                return f"serial:RUN_DIR/{name}{options}"
            if link.scheme == "tcp" and not link.host_port()[0].startswith(("127.", "localhost", "::1")):
                return f"tcp://127.0.0.1:{link.host_port()[1]}{options}"
        except LinkConfigError:
            pass  # said with the other mistakes
        return url

    board, radio = settings.actuators, settings.radio
    return settings.model_copy(
        update={
            "sensors": tuple(item.model_copy(update={"url": place(item.name, item.url)}) for item in settings.sensors),
            "actuators": board.model_copy(update={"url": place("arduino", board.url)}) if board.url else board,
            "radio": radio.model_copy(update={"url": place("lora-vessel", radio.url)}) if radio.url else radio,
        }
    )


def at_speed(settings: SimSettings, speed: float | None) -> SimSettings:
    """Settings for a simulation ``speed`` times as fast as real time (None: in lock-step, no station can follow).

    The vessel counts its own seconds, and a ground station sends a heartbeat in each real one: the time-out grows with the speed.
    """
    if speed is None or speed <= STATION_SPEED:
        return settings
    timeout_s = min(settings.failsafe.gcs_timeout_s * speed / STATION_SPEED, 120.0)
    return settings.model_copy(update={"failsafe": settings.failsafe.model_copy(update={"gcs_timeout_s": timeout_s})})

"""Settings of the simulator: what the vessel's own settings do not know about the world around it."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from companion.core.config import Config
from companion.settings import Settings

from .bottom import BottomConfig
from .radio import RadioConfig
from .sensors import SensorConfig
from .water import WaterConfig


class WorldConfig(Config):
    """The simulated surroundings."""

    latitude_deg: float = Field(41.1850123, ge=-89, le=89)
    longitude_deg: float = Field(-8.7062154, ge=-180, le=180)
    heading_deg: float = Field(0.0, ge=0, lt=360)
    """Where the vessel starts, and which way it looks."""
    step_us: int = Field(20_000, ge=1_000, le=50_000)
    """Step of the physics."""
    vessel: str = ""
    """The hull that is really there; empty = the one the vessel believes in."""
    arduino: Literal["twin", "firmware"] = "twin"
    """The actuator board: its Python twin, or the real AVR binary on a simulated chip."""
    sensors: SensorConfig = SensorConfig()
    water: WaterConfig = WaterConfig()
    bottom: BottomConfig = BottomConfig()
    radio: RadioConfig = RadioConfig()

    @property
    def start_rad(self) -> tuple[float, float]:
        return math.radians(self.latitude_deg), math.radians(self.longitude_deg)


class SimSettings(Settings):
    """The vessel's settings plus the world's."""

    world: WorldConfig = WorldConfig()

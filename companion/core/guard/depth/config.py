"""Settings of the depth guard and its look-ahead."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from ...config import Config, param
from .input import DepthInputConfig
from .memory import DepthMemoryConfig


class DepthMapConfig(Config):
    """A depth map for the way ahead and for plans."""

    file: Path | None = None
    """Soundings (XYZ: longitude latitude depth; CSV with a header; DUNE ini) or a stored grid (.depth)."""
    order: Literal["lon-lat", "lat-lon"] = "lon-lat"
    """Order of the columns of an XYZ file."""
    pitch_m: float = Field(5.0, ge=0.5, le=1000)
    """Size of a cell."""
    spread_m: float = Field(10.0, ge=0, le=1000)
    """A sounding counts for all water within this distance; the shallowest one wins. Beyond it the depth is unknown."""


class DepthGuardConfig(Config):
    """The guard's limits. The first three are the seed's, by name."""

    enabled: bool = param(True, "DEPTH_ENABLE", "Guard the water under the keel")
    min_altitude_m: float = param(
        4.0,
        "DEPTH_MIN",
        "Least water under the keel",
        unit="m",
        ge=0,
        le=1000,
        seed="MinAltitude: Minimum Acceptable Altitude",
    )
    minimum_margin_m: float = param(
        0.1,
        "DEPTH_MARGIN_LO",
        "Below the least altitude by more than this: locked",
        unit="m",
        ge=0,
        le=100,
        seed="MinAltitude: Minimum Altitude Margin",
    )
    good_margin_m: float = param(
        0.1,
        "DEPTH_MARGIN_HI",
        "Above the least altitude by this: good again",
        unit="m",
        ge=0,
        le=100,
        seed="MinAltitude: Good Altitude Margin",
    )
    required: bool = param(False, "DEPTH_REQUIRED", "No arming and no going on without a water depth")
    unknown_policy: Literal["ignore", "warn", "slow", "stop"] = "warn"
    """When the altitude is unknown: nothing (the seed), tell, tell and go slow, or tell and stop after 5 s.

    Unless it is nothing: over a bottom that was closing the vessel goes slow at once, and stops where the limit would be."""
    unknown_speed_mps: float = Field(0.5, gt=0, le=5)
    """Speed under the policy ``slow``, and over a bottom that was closing when the sounder fell silent."""
    rate_look_ahead: bool = param(True, "DEPTH_LOOK_RATE", "Stop earlier when the bottom is closing (off: seed parity)")
    map_look_ahead: bool = param(True, "DEPTH_LOOK_MAP", "Use depth map and depth memory along the way ahead")
    brake: bool = param(False, "DEPTH_BRAKE", "Brake with astern thrust at a depth stop")
    reaction_s: float = Field(0.6, ge=0, le=5)
    """From a reading to a propeller that is told to stop: tick, decision, line (the lags of filter and propeller are reckoned apart)."""
    warn_s: float = Field(20.0, ge=0, le=600)
    """Tell when the least altitude will be reached within this time."""
    slow_share: float = Field(1.5, ge=1, le=10)
    """Slow down when this many times the way to stop would use up the water that is left."""
    slow_least_mps: float = Field(0.5, gt=0, le=5)
    """Slower than this is not asked for; the stop follows."""
    tide_m: float = param(
        0.0, "DEPTH_TIDE", "Water level above the datum of depth map and memory", unit="m", ge=-20, le=20
    )
    map_sigma_m: float = Field(0.0, ge=0, le=20)
    """Stated uncertainty of the depth map; taken off its depths."""
    input: DepthInputConfig = Field(default_factory=DepthInputConfig)
    map: DepthMapConfig = Field(default_factory=DepthMapConfig)
    memory: DepthMemoryConfig = Field(default_factory=DepthMemoryConfig)

    def datum_offset_m(self, keel_m: float) -> float:
        """From depth below chart datum to altitude under the keel, m."""
        return self.tide_m - keel_m

    def map_offset_m(self, keel_m: float) -> float:
        """The same for a charted depth, whose uncertainty comes off."""
        return self.datum_offset_m(keel_m) - self.map_sigma_m

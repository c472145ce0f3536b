"""Settings and faults of the simulated sensors."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final, Literal

from pydantic import Field

from companion.core.config import Config

SensorClass = Literal["rtk", "sbas", "standalone", "ideal"]


@dataclass(frozen=True, slots=True)
class ClassFigures:
    """Errors of one class of GNSS compass (vessel-control §1.3). White noise, and slow first-order Gauss-Markov."""

    position_white_m: float
    position_slow_m: float
    velocity_white_mps: float
    heading_white_deg: float
    heading_slow_deg: float
    rate_white_radps: float
    depth_white: float
    """Share of the sounder's configured noise."""
    quality: int
    """GGA quality."""
    mode: str
    """RMC and VTG mode letter."""
    satellites: int
    hdop: float


CLASSES: Final[dict[str, ClassFigures]] = {
    "rtk": ClassFigures(
        position_white_m=0.03,
        position_slow_m=0.0,
        velocity_white_mps=0.05,
        heading_white_deg=0.5,
        heading_slow_deg=0.5,
        rate_white_radps=0.003,
        depth_white=1.0,
        quality=4,
        mode="R",
        satellites=18,
        hdop=0.6,
    ),
    "sbas": ClassFigures(
        position_white_m=0.15,
        position_slow_m=0.6,
        velocity_white_mps=0.08,
        heading_white_deg=0.7,
        heading_slow_deg=1.0,
        rate_white_radps=0.003,
        depth_white=1.0,
        quality=2,
        mode="D",
        satellites=12,
        hdop=0.8,
    ),
    "standalone": ClassFigures(
        position_white_m=0.40,
        position_slow_m=1.5,
        velocity_white_mps=0.12,
        heading_white_deg=1.0,
        heading_slow_deg=3.0,
        rate_white_radps=0.003,
        depth_white=1.0,
        quality=1,
        mode="A",
        satellites=9,
        hdop=1.1,
    ),
    "ideal": ClassFigures(
        position_white_m=0.0,
        position_slow_m=0.0,
        velocity_white_mps=0.0,
        heading_white_deg=0.0,
        heading_slow_deg=0.0,
        rate_white_radps=0.0,
        depth_white=0.0,
        quality=4,
        mode="R",
        satellites=20,
        hdop=0.5,
    ),
}


class SimulatedSensors(Config):
    """The simulated GNSS compass and echo sounder."""

    grade: SensorClass = "rtk"
    """rtk, sbas, standalone or ideal."""
    sentences: str = "GPZDA, GPGGA, GPRMC, GPVTG, GPHDT"
    """The sentences of one epoch, in order (the seed's by default). GST may be added."""
    fix_hz: float = Field(5.0, ge=0.1, le=50.0)
    """Epochs a second."""
    fix_latency_s: float = Field(0.12, ge=0.0, le=2.0)
    """From the time of a fix to its first byte."""
    heading_hz: float = Field(10.0, ge=0.0, le=100.0)
    """0 = only the heading inside the epoch."""
    heading_sentence: Literal["HDT", "THS", "HDG", "HDM"] = "HDT"
    """How the heading is said; HDG and HDM are magnetic."""
    rate_hz: float = Field(10.0, ge=0.0, le=100.0)
    """ROT; 0 = none."""
    attitude_sentence: Literal["", "PASHR", "PSAT", "PSXN"] = ""
    """Roll and pitch, with the heading's rate; empty = not measured."""
    talker: str = Field("GP", pattern="^[A-Z]{2}$")
    """The two letters before HDG, ROT and the like."""
    depth_hz: float = Field(10.0, ge=0.0, le=50.0)
    """0 = no echo sounder."""
    depth_sentence: Literal["DPT", "DBT"] = "DPT"
    """How the depth is said: below the transducer with its offset, or below it alone."""
    position_tau_s: float = Field(200.0, gt=0.0)
    """Time constant of the slow error of position."""
    heading_tau_s: float = Field(60.0, gt=0.0)
    """Time constant of the slow error of heading."""
    geoid_m: float = Field(52.3, ge=-120.0, le=120.0)
    """Height of the geoid above the ellipsoid, for GGA."""
    variation_deg: float | None = Field(None, ge=-180.0, le=180.0)
    """Magnetic variation, sent in RMC and HDG and subtracted for HDG and HDM; None = blank, and no difference."""
    heading_mount_deg: float = 0.0
    """The baseline shows this much less than the hull's heading."""
    sounder_sigma_m: float = Field(0.05, ge=0.0, le=5.0)
    """Noise of a sounding."""
    sounder_sigma_share: float = Field(0.005, ge=0.0, le=0.2)
    """The same as a share of the depth; the larger of the two counts."""
    sounder_dropout: float = Field(0.02, ge=0.0, le=1.0)
    """Share of readings without a bottom."""
    sounder_outlier: float = Field(0.01, ge=0.0, le=1.0)
    """Share of false echoes (0.3, 0.5 or 2 times the depth)."""
    sounder_blanking_m: float = Field(0.3, ge=0.0, le=10.0)
    """Nearer than this the sounder hears nothing."""
    sounder_range_m: float = Field(100.0, ge=1.0, le=5000.0)
    """Farther than this neither."""
    sounder_cone_deg: float = Field(20.0, ge=1.0, le=60.0)
    """Full width of the beam: a tilt of up to half of it changes nothing. The bottom is heard straight below, up a slope too."""


@dataclass(slots=True)
class SensorFaults:
    """What is wrong with the sensors now. Change fields at any time; scenarios set them by name."""

    gnss_silent: bool = False
    no_fix: bool = False
    frozen: bool = False
    """The receiver repeats its last position and speed, time goes on."""
    stuck: bool = False
    """The receiver repeats its last epoch byte for byte, time included."""
    jump_north_m: float = 0.0
    jump_east_m: float = 0.0
    dead_reckoning: bool = False
    heading_silent: bool = False
    heading_bias_deg: float = 0.0
    """180 = flipped."""
    heading_frozen: bool = False
    """The compass repeats its last heading."""
    rate_silent: bool = False
    rate_frozen: bool = False
    """The sensor repeats its last turn rate."""
    depth_silent: bool = False
    depth_no_bottom: bool = False
    depth_bias_m: float = 0.0
    depth_frozen: bool = False
    """The sounder repeats its last reading."""
    depth_says_range: bool = False
    """The sounder hears no bottom, and says the end of its range instead of nothing."""
    depth_echoes_below_m: float = 0.0
    """With less than this below it the sounder hears the second echo, from twice the distance."""
    weeks_off: int = 0
    """Weeks by which the receiver's date is behind; 1024 is the roll-over."""
    utc_blank: bool = False
    """Date and time fields are blank, as before the first fix."""
    cut_share: float = 0.0
    """Share of sentences that lose their end."""
    flip_share: float = 0.0
    """Share of sentences with one bit flipped."""
    loss_share: float = 0.0
    """Share of sentences that never arrive."""
    no_line_end: bool = False
    flood: int = 1
    """Every sentence is sent this many times."""

    def set(self, name: str, value: Any) -> None:
        """Set one fault by name. Raises ValueError for an unknown name or a value of the wrong kind."""
        for field in fields(self):
            if field.name == name:
                current = getattr(self, name)
                if isinstance(current, bool) != isinstance(value, bool) or not isinstance(value, bool | int | float):
                    raise ValueError(f"sensor fault {name}: {value!r} is of the wrong kind")
                setattr(self, name, value if isinstance(current, bool) else type(current)(value))
                return
        known = ", ".join(field.name for field in fields(self))
        raise ValueError(f"no sensor fault {name!r}; there are {known}")

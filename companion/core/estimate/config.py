"""Settings of the estimator: time limits, gates, mounting of the antennas, and how much each kind of fix is believed."""

from __future__ import annotations

from typing import Final

from pydantic import Field

from mavlink_bridge.language.messages import FixType

from ..config import Config, param


class EstimatorConfig(Config):
    """How measurements become the vessel's state."""

    position_timeout_s: float = param(
        1.0, "EST_POS_TIMEOUT", "A position older than this is no position", unit="s", ge=0.2, le=10.0
    )
    slow_receiver_s: float = Field(3.0, ge=0.2, le=10.0)
    """A receiver slower than 3 fixes per position_timeout_s gets three of its periods, at most this long."""
    heading_timeout_s: float = param(
        0.5, "EST_HDG_TIMEOUT", "A heading older than this is no heading", unit="s", ge=0.1, le=5.0
    )
    heading_late_s: float = Field(0.0, ge=0.0, le=1.0)
    """Age of headings and turn rates when they arrive, s: their time begins to run then. Where it is not said, the greatest
    `sensors.nmea.heading_latency_s`."""
    slow_compass_s: float = Field(2.2, ge=0.1, le=10.0)
    """A compass slower than two headings per heading_timeout_s gets two of its periods, at most this long."""
    attitude_timeout_s: float = Field(1.0, ge=0.1, le=10.0)
    """Roll and pitch older than this are unknown."""
    course_speed_mps: float = param(
        1.0,
        "EST_COURSE_SPD",
        "Above this speed through the water the course stands in for a lost heading",
        unit="m/s",
        ge=0.3,
        le=20.0,
    )
    course_lead_s: float = Field(0.5, ge=0.0, le=5.0)
    """The motion of the hull follows its heading so much later; made up for when the course stands in without a turn
    rate sensor."""
    speed_max_mps: float = param(
        10.0, "EST_SPEED_MAX", "No faster than this between two positions", unit="m/s", ge=1.0, le=60.0
    )
    position_jump_m: float = param(
        20.0, "EST_POS_JUMP", "A position this far off the expected one is a jump", unit="m", ge=1.0, le=1000.0
    )
    position_hold_s: float = Field(2.0, ge=0.0, le=10.0)
    """So long the expected position stands in while jumped ones are refused."""
    heading_jump_deg: float = param(
        25.0, "EST_HDG_JUMP", "A heading this far off the expected one is a jump", unit="deg", ge=5.0, le=180.0
    )
    heading_rate_max_dps: float = Field(60.0, ge=5.0, le=360.0)
    """The vessel never turns faster; widens the heading gate with time."""
    heading_hold_s: float = Field(1.0, ge=0.0, le=10.0)
    """So long the expected heading stands in while jumped ones are refused."""
    reaccept_s: float = Field(10.0, ge=1.0, le=600.0)
    """Refused values that agree with each other for this long are taken as the new truth, with a text."""
    frozen_warn_s: float = Field(5.0, ge=1.0, le=60.0)
    """The very same position for this long while moving is warned of."""
    frozen_invalid_s: float = Field(10.0, ge=1.0, le=120.0)
    """And for this long it is no position any more."""
    accept_dead_reckoning: bool = False
    """Take positions that the receiver itself extrapolates (GGA quality 6)."""
    accept_simulated: bool = False
    """Take positions marked manual or simulated (GGA quality 7, 8): bench tests only."""
    heading_offset_deg: float = param(
        0.0,
        "EST_HDG_OFFSET",
        "Added to the compass heading (mounting of the baseline)",
        unit="deg",
        ge=-180.0,
        le=180.0,
    )
    roll_offset_deg: float = Field(0.0, ge=-45.0, le=45.0)
    """Added to the roll as measured: how askew the sensor is mounted."""
    pitch_offset_deg: float = Field(0.0, ge=-45.0, le=45.0)
    """Added to the pitch as measured."""
    variation_deg: float | None = Field(None, ge=-180.0, le=180.0)
    """Magnetic variation, east positive, for HDG and HDM when neither they nor the receiver give one. None: then the
    World Magnetic Model, and without that a magnetic heading is not used."""
    world_magnetic_model: bool = True
    """Take the variation from the World Magnetic Model when nothing else gives one."""
    drift_tau_s: float = Field(12.0, ge=0.5, le=600.0)
    """Time constant of the drift vector."""
    velocity_sigma_mps: float = Field(0.08, gt=0.0, le=5.0)
    """White noise of the receiver's velocity."""
    acceleration_psd: float = Field(0.02, gt=0.0, le=100.0)
    """How lively the vessel moves, m2/s3."""
    heading_sigma_deg: float = Field(0.5, gt=0.0, le=20.0)
    """White noise of the compass."""
    rate_sigma_dps: float = Field(0.3, gt=0.0, le=20.0)
    """White noise of the measured rate of turn."""
    yaw_acceleration_psd: float = Field(0.03, gt=0.0, le=100.0)
    """How lively the vessel turns, rad2/s3."""
    align_clock: bool = True
    """Take the times of fixes from their UTC, against jitter of arrival."""


POSITION_SIGMA_M: Final = {
    FixType.FIX_2D: 0.5,
    FixType.FIX_3D: 0.4,
    FixType.DGPS: 0.15,
    FixType.RTK_FLOAT: 0.10,
    FixType.RTK_FIXED: 0.03,
}
"""White noise from fix to fix (vessel-control §1.3); the slow wander of a fix cannot be filtered."""

POSITION_ACCURACY_M: Final = {
    FixType.FIX_2D: 5.0,
    FixType.FIX_3D: 3.0,
    FixType.DGPS: 1.5,
    FixType.RTK_FLOAT: 0.5,
    FixType.RTK_FIXED: 0.1,
}
"""How far a fix may be off altogether (1 sigma), for comparing two receivers."""

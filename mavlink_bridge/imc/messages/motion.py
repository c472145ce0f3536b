"""Messages about where a system is, what it measures, and what its actuators do."""

from __future__ import annotations

from typing import ClassVar

from ..fields import F32, F64, I16, U8, U16, U32, ListOf, Message, Text, message


@message
class SimulatedState(Message):
    """What a simulator knows to be true; the fields of EstimatedState and the stream's velocity."""

    NUMBER: ClassVar[int] = 50
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    height_m: F32 = 0.0
    x_m: F32 = 0.0
    y_m: F32 = 0.0
    z_m: F32 = 0.0
    phi_rad: F32 = 0.0
    theta_rad: F32 = 0.0
    psi_rad: F32 = 0.0
    u_mps: F32 = 0.0
    v_mps: F32 = 0.0
    w_mps: F32 = 0.0
    p_radps: F32 = 0.0
    q_radps: F32 = 0.0
    r_radps: F32 = 0.0
    svx_mps: F32 = 0.0
    svy_mps: F32 = 0.0
    svz_mps: F32 = 0.0


@message
class Rpm(Message):
    NUMBER: ClassVar[int] = 250
    value_rpm: I16 = 0


@message
class Voltage(Message):
    NUMBER: ClassVar[int] = 251
    value_v: F32 = 0.0


@message
class Current(Message):
    NUMBER: ClassVar[int] = 252
    value_a: F32 = 0.0


@message
class GpsFix(Message):
    """One fix of a receiver; ``validity`` says which fields mean anything."""

    NUMBER: ClassVar[int] = 253
    validity: U16 = 0
    """``FixValidity``."""
    type: U8 = 0
    """A ``FixKind``."""
    utc_year: U16 = 0
    utc_month: U8 = 0
    utc_day: U8 = 0
    utc_time_s: F32 = 0.0
    """Since midnight."""
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    height_m: F32 = 0.0
    """Above the ellipsoid."""
    satellites: U8 = 0
    cog_rad: F32 = 0.0
    sog_mps: F32 = 0.0
    hdop: F32 = 0.0
    vdop: F32 = 0.0
    hacc_m: F32 = 0.0
    vacc_m: F32 = 0.0


@message
class EulerAngles(Message):
    NUMBER: ClassVar[int] = 254
    time_s: F64 = 0.0
    """When it was measured: UTC, s since 1970."""
    phi_rad: F64 = 0.0
    theta_rad: F64 = 0.0
    psi_rad: F64 = 0.0
    psi_magnetic_rad: F64 = 0.0


@message
class DeviceState(Message):
    """Where a device is mounted, from the vehicle's centre."""

    NUMBER: ClassVar[int] = 282
    x_m: F32 = 0.0
    y_m: F32 = 0.0
    z_m: F32 = 0.0
    phi_rad: F32 = 0.0
    theta_rad: F32 = 0.0
    psi_rad: F32 = 0.0


@message
class BeamConfig(Message):
    NUMBER: ClassVar[int] = 283
    beam_width_rad: F32 = 0.0
    beam_height_rad: F32 = 0.0


@message
class Distance(Message):
    """A range, here an echo sounder's."""

    NUMBER: ClassVar[int] = 262
    validity: U8 = 0
    """A ``DistanceValidity``."""
    location: ListOf[DeviceState] = ()
    beam_config: ListOf[BeamConfig] = ()
    value_m: F32 = 0.0


@message
class FuelLevel(Message):
    NUMBER: ClassVar[int] = 279
    value_pct: F32 = 0.0
    confidence_pct: F32 = 0.0
    opmodes: Text = ""
    """What the fuel would do for: ``Motion=6.5;Idle=20.0``, h."""


@message
class SetThrusterActuation(Message):
    NUMBER: ClassVar[int] = 301
    id: U8 = 0
    value: F32 = 0.0
    """-1...1, 0 stopped."""


@message
class SetServoPosition(Message):
    NUMBER: ClassVar[int] = 302
    id: U8 = 0
    value_rad: F32 = 0.0


@message
class EstimatedState(Message):
    """Position is ``lat_rad``, ``lon_rad`` displaced by ``x_m`` north and ``y_m`` east."""

    NUMBER: ClassVar[int] = 350
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    height_m: F32 = 0.0
    x_m: F32 = 0.0
    y_m: F32 = 0.0
    z_m: F32 = 0.0
    phi_rad: F32 = 0.0
    theta_rad: F32 = 0.0
    psi_rad: F32 = 0.0
    u_mps: F32 = 0.0
    v_mps: F32 = 0.0
    w_mps: F32 = 0.0
    vx_mps: F32 = 0.0
    vy_mps: F32 = 0.0
    vz_mps: F32 = 0.0
    p_radps: F32 = 0.0
    q_radps: F32 = 0.0
    r_radps: F32 = 0.0
    depth_m: F32 = 0.0
    alt_m: F32 = -1.0
    """Water under the vehicle; -1 unknown."""


@message
class DesiredPath(Message):
    NUMBER: ClassVar[int] = 406
    path_ref: U32 = 0
    start_lat_rad: F64 = 0.0
    start_lon_rad: F64 = 0.0
    start_z_m: F32 = 0.0
    start_z_units: U8 = 0
    end_lat_rad: F64 = 0.0
    end_lon_rad: F64 = 0.0
    end_z_m: F32 = 0.0
    end_z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    lradius_m: F32 = 0.0
    flags: U8 = 0


@message
class PathControlState(Message):
    """Where the vehicle is on its path: ``x_m`` to go along it, ``y_m`` off it, starboard positive."""

    NUMBER: ClassVar[int] = 410
    path_ref: U32 = 0
    start_lat_rad: F64 = 0.0
    start_lon_rad: F64 = 0.0
    start_z_m: F32 = 0.0
    start_z_units: U8 = 0
    end_lat_rad: F64 = 0.0
    end_lon_rad: F64 = 0.0
    end_z_m: F32 = 0.0
    end_z_units: U8 = 0
    lradius_m: F32 = 0.0
    flags: U8 = 0
    """``PathFlags``."""
    x_m: F32 = 0.0
    y_m: F32 = 0.0
    z_m: F32 = 0.0
    vx_mps: F32 = 0.0
    vy_mps: F32 = 0.0
    vz_mps: F32 = 0.0
    course_error_rad: F32 = 0.0
    eta_s: U16 = 0


@message
class AisInfo(Message):
    """Another vessel, as her AIS told of her. What her transponder did not say is AIS' own number for it."""

    NUMBER: ClassVar[int] = 912
    msg_type: Text = ""
    """Of the AIS message: 1 a position."""
    sensor_class: Text = ""
    mmsi: Text = ""
    callsign: Text = ""
    name: Text = ""
    nav_status: U8 = 15
    type_and_cargo: U8 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    course_deg: F32 = 360.0
    speed_kn: F32 = 102.3
    dist_m: F32 = -1.0
    """From us; negative: we do not know where we are."""
    a_m: F32 = 0.0
    """Antenna to bow; b to the stern, c to port, d to starboard."""
    b_m: F32 = 0.0
    c_m: F32 = 0.0
    d_m: F32 = 0.0
    draught_m: F32 = 0.0

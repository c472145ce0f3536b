"""The vocabulary: what the parts of the vessel tell each other.

Frozen dataclasses named after the IMC messages they re-do. SI units, radians, north-east-down, WGS-84;
headings clockwise from true north in [-pi, pi); thrusters -1...1 with 0 = stopped; times in integer
microseconds of the vessel's monotonic clock; ``None`` means unknown, never a magic number. *Altitude* is
height above the sea bed, as in IMC. ``mapping.py`` is the only place that turns these into MAVLink fields.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum

from .figures import (
    Circle as Circle,
    Figure as Figure,
    FigureEight as FigureEight,
    Hover as Hover,
    LoiterDirection as LoiterDirection,
    Racetrack as Racetrack,
)
from .maneuvers import (
    ChangeSpeed as ChangeSpeed,
    Delay as Delay,
    FenceArea as FenceArea,
    FenceEnable as FenceEnable,
    Goto as Goto,
    Jump as Jump,
    Loiter as Loiter,
    Maneuver as Maneuver,
    Noted as Noted,
    PlanSpecification as PlanSpecification,
    ReturnHome as ReturnHome,
    SetHome as SetHome,
)
from .value import value


class FixType(IntEnum):
    """Kind of position fix; values equal MAVLink's GPS_FIX_TYPE where that has one (dune-imc table G2)."""

    NONE = 1
    FIX_2D = 2
    FIX_3D = 3
    DGPS = 4
    RTK_FLOAT = 5
    RTK_FIXED = 6


@value
class Source:
    """Which sensor said it (IMC's source entity): each talker and sentence of a link is one of its own."""

    link: str = ""
    """The sensor link's name in the settings."""
    address: str = ""
    """Talker and sentence, ``HEHDT``; of a fix the receiver on its link, whose talkers may change."""
    rank: tuple[int, ...] = (0,)
    """Order of preference; lower comes first. The first figure counts across links, the others within one."""
    name: str = ""
    """What the operator reads instead of the address, when that is given."""


@value
class GpsFix:
    """One epoch of a GNSS receiver (IMC GpsFix). Absent fields are None; a position needs a fix of 2-D or better."""

    t_us: int
    """When the epoch's first byte arrived, less the configured latency: the time of validity."""
    fix_type: FixType
    lat_rad: float | None = None
    lon_rad: float | None = None
    height_msl_m: float | None = None
    height_ellipsoid_m: float | None = None
    utc_us: int | None = None
    """UTC of the epoch, microseconds since 1970; None unless both date and time are known."""
    satellites: int | None = None
    hdop: float | None = None
    vdop: float | None = None
    hacc_m: float | None = None
    vacc_m: float | None = None
    sog_mps: float | None = None
    cog_rad: float | None = None
    dead_reckoning: bool = False
    simulated: bool = False
    """True for GGA quality 7 and 8 (manual input, simulator)."""
    complete: bool = True
    """False when the epoch was closed before its last expected sentence."""
    source: Source | None = None

    @property
    def has_position(self) -> bool:
        return self.fix_type >= FixType.FIX_2D and self.lat_rad is not None and self.lon_rad is not None


@value
class EulerAngles:
    """Attitude from the compass (IMC EulerAngles). Each axis has its own validity: None when not measured."""

    t_us: int
    phi_rad: float | None = None
    theta_rad: float | None = None
    psi_rad: float | None = None
    psi_magnetic_rad: float | None = None
    psi_accuracy_rad: float | None = None
    variation_rad: float | None = None
    """Magnetic variation, east positive, when the compass or the receiver says it; psi = psi_magnetic + variation."""
    source: Source | None = None


@value
class AngularVelocity:
    """Turn rate about the down axis (IMC AngularVelocity), starboard positive."""

    t_us: int
    r_radps: float
    source: Source | None = None


@value
class Distance:
    """One echo-sounder reading (IMC Distance): metres from the transducer to the bottom, before any offset."""

    t_us: int
    value_m: float | None
    """None when the sounder reports no bottom; so does 0, see ``bottom_m``."""
    offset_m: float | None = None
    """DPT's own offset: positive = transducer to waterline, negative = transducer to keel. Carried, not added."""
    range_max_m: float | None = None
    signal_quality: float | None = None
    """0...1, None when the source does not say."""
    source: Source | None = None

    @property
    def bottom_m(self) -> float | None:
        """The reading; None for 0, which sounders say when they hear no bottom: none of them measures so near."""
        value_m = self.value_m
        return value_m if value_m is not None and value_m > 0.0 else None


Measurement = GpsFix | EulerAngles | AngularVelocity | Distance
"""What a sensor tells. Who takes one apart ends with ``assert_never``, so that the next kind is forgotten nowhere."""


@value
class SupplyVoltage:
    """Battery as seen by the actuator board or another source (IMC Voltage, Current, FuelLevel)."""

    t_us: int
    voltage_v: float | None
    current_a: float | None = None
    remaining: float | None = None
    """0...1."""


@value
class EstimatedState:
    """The vessel's state at a tick (IMC EstimatedState), predicted from the newest measurements.

    Position is given twice: geodetic, and metres north and east of ``origin`` (fixed for the run). Every age is
    the time since the measurement behind a value; a value older than its limit is None.
    """

    t_us: int
    lat_rad: float | None = None
    lon_rad: float | None = None
    height_msl_m: float | None = None
    origin_lat_rad: float | None = None
    origin_lon_rad: float | None = None
    x_m: float | None = None
    y_m: float | None = None
    vx_mps: float | None = None
    vy_mps: float | None = None
    u_mps: float | None = None
    """Surge over ground, body axes."""
    v_mps: float | None = None
    phi_rad: float | None = None
    theta_rad: float | None = None
    psi_rad: float | None = None
    r_radps: float | None = None
    sog_mps: float | None = None
    cog_rad: float | None = None
    drift_n_mps: float | None = None
    """Estimated drift of the water and the wind together, NED: ground velocity less speed through the water."""
    drift_e_mps: float | None = None
    current_n_mps: float | None = None
    """The drift without what the hull's file says wrongly of the speed through the water, NED: to steer by."""
    current_e_mps: float | None = None
    made_share: float = 0.0
    """What the hull makes more through the water than its file says, over what the file says."""
    alt_m: float | None = None
    """Height of the keel above the bottom, filtered by the depth guard's input chain."""
    fix_n_mps: float | None = None
    """Ground velocity of the fix that was taken since the last tick, NED, as its receiver told it, at the vessel's reference point;
    it was valid ``position_age_s`` ago. None: no new fix, or one without a velocity."""
    fix_e_mps: float | None = None
    position_age_s: float | None = None
    heading_age_s: float | None = None
    depth_age_s: float | None = None
    fix_type: FixType = FixType.NONE
    heading_from_course: bool = False
    """True when psi is the course over ground because the compass is lost."""

    @property
    def position_valid(self) -> bool:
        return self.x_m is not None and self.y_m is not None

    @property
    def compass_rad(self) -> float | None:
        """Where the bow points; None while only the course stands in for it, which says nothing of slip and turning."""
        return None if self.heading_from_course else self.psi_rad

    @property
    def heading_valid(self) -> bool:
        return self.psi_rad is not None


class Mode(Enum):
    """What the vessel is doing. The numbers on the wire are the personas' business (``modes.py``)."""

    MANUAL = "Manual"
    HOLD = "Hold"
    AUTO = "Auto"
    RTL = "Return"
    GUIDED = "Guided"
    CIRCLE = "Circle"
    LOITER = "Loiter"


class PlanState(IntEnum):
    """IMC PlanControlState; values equal MAVLink's MISSION_STATE."""

    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


@value
class PathControlState:
    """How guidance does on its path (IMC PathControlState). Cross-track positive to starboard of the path."""

    cross_track_m: float | None = None
    distance_m: float | None = None
    """To the next point, or to the path when not on it yet."""
    target_bearing_rad: float | None = None
    target_lat_rad: float | None = None
    target_lon_rad: float | None = None
    on_path: bool = False
    orbit_radius_m: float | None = None
    """Signed, clockwise positive, while circling (ORBIT_EXECUTION_STATUS)."""
    orbit_lat_rad: float | None = None
    orbit_lon_rad: float | None = None
    eight: tuple[float, float, float] | None = None
    """While sailing a figure-eight about the target: loop radius (m, positive: the first loop along the axis is clockwise),
    distance between the loops' centres (m), axis (rad from north)."""


@value
class Desired:
    """What guidance asks of steering (IMC DesiredHeading and DesiredSpeed), with feed-forward.

    ``speed_mps`` is over ground unless ``through_water``. ``psi_rad`` None = no heading loop; ``speed_mps`` None = no speed loop.
    """

    psi_rad: float | None
    speed_mps: float | None
    r_radps: float = 0.0
    """Yaw-rate feed-forward."""
    through_water: bool = False
    brake: bool = False
    """Allow astern thrust to lose way."""
    gentle: bool = False
    """Turn with so little thrust that the way on stays as it is asked for."""
    asked_mps: float | None = None
    """Along a path: speed over ground that the plan asks for here. In a strong stream ``speed_mps`` is what can be made of it."""
    yaw_nm: float = 0.0
    """On station: moment, to starboard, that takes what the wind is known to turn the hull with as it lies."""
    firmness: float = 0.0
    """On station: how much the wind asks for hard loops of heading and speed, soft ones being the rule there, 0 to 1."""


@value
class ActuatorDemand:
    """What a controller wants (IMC SetThrusterActuation and SetServoPosition); the gate decides what goes out."""

    t_us: int
    thruster_port: float = 0.0
    thruster_starboard: float = 0.0
    rudder_port_rad: float = 0.0
    rudder_starboard_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class ActuatorOutput:
    """What goes to the actuators. Only ``companion.core.guard.gate`` makes one; an architecture test holds that."""

    t_us: int
    thruster_port: float
    thruster_starboard: float
    rudder_port_rad: float
    rudder_starboard_rad: float
    cause: str
    """Why these values: 'demand', or the reason for neutral."""


class GuardState(IntEnum):
    """The minimum-altitude guard (seed MinAltitude, with the missing state added)."""

    UNKNOWN = 0
    OK = 1
    CORRECTION = 2
    LOCKED = 3


class Action(IntEnum):
    """Failsafe actions; a later one wins."""

    NONE = 0
    WARN = 1
    HOLD = 2
    RETURN = 3
    STOP = 4
    DISARM = 5
    TERMINATE = 6


class Severity(IntEnum):
    """MAV_SEVERITY, of operator texts."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


@dataclass(frozen=True, slots=True)
class LogText:
    """One text for the operator (IMC LogBookEntry). ``number`` grows by one for each text of the run."""

    number: int
    t_us: int
    severity: Severity
    text: str


@value
class ActuatorStatus:
    """What the actuator board says of itself (its status line)."""

    t_us: int
    connected: bool = False
    level: int | None = None
    """Protocol level: 0 the seed's unchecked letters, 1 checked lines; None before negotiation."""
    state: str = "unknown"
    applied_us: tuple[int, int, int, int] | None = None
    """Pulse widths at the pins: thruster 1, thruster 2, rudder 1, rudder 2."""
    commanded_us: tuple[int, int, int, int] | None = None
    """The same as last commanded, of a board on level 0 that tells nothing of its pins."""
    good_frames: int = 0
    bad_frames: int = 0
    reset_cause: str | None = None
    emergency_stop: bool = False
    voltage_v: float | None = None

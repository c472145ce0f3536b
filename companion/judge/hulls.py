"""Figures of a hull file that cannot be of one boat: a slip of unit or sign, or what no floating hull has.

The bounds are wide: they are what nature gives, or several times what any small boat has. How well the figures fit is for the
sea trial to say.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

from ..core.hull import VesselConfig
from ..core.hull.statics import top_speed_mps
from ..core.hull.vessel_file import RHO_WATER

_FULLEST: Final = 1.1
"""Mass over that of the water in the box around the hull: 1 at most, and a tenth for what was measured roughly."""
_FINEST: Final = 0.02
"""The same of the slenderest: two needles at the ends of a wide beam have 0.05."""
_ADDED: Final = 0.7
"""Inertia with the water that moves along, over the mass: never below 1; less is forgiven to a fit of a poor record."""
_GYRATION: Final = (0.08, 1.5)
"""Radius of gyration over the length, with the added inertia: small boats have 0.25 to 0.5."""
_QUICKEST: Final = (
    ("xu", "m11_kg", 10.0, "1/s"),
    ("yv", "m22_kg", 10.0, "1/s"),
    ("nr", "m33_kgm2", 10.0, "1/s"),
    ("nrr", "m33_kgm2", 120.0, "1/rad"),
)
"""Damping over its inertia: ten times what boats of 1 to 6 m have. What steps through time with more runs away."""
_DAMPED_PER_S: Final = 0.3
"""Yaw damping at rest over its inertia: the shipped hulls have 0.7 to 1.3, and what was measured by two turns on the spot alone 0.1."""
_SPEEDS_MPS: Final = (0.2, 25.0)
"""Top speeds: below, nothing could be held against a breeze; 25 m/s are 49 knots."""
_LAG_S: Final = 5.0
"""Longer than any motor or servo of a small boat takes to two thirds: milliseconds, or a broken one."""
_STROKE_S: Final = 10.0
"""From amidships to hard over: the slowest steering engines take half of it."""
_RADIANS_DEG: Final = 3.0
"""No rudder is stopped, or stalls, at less: 0.5 is half a radian."""
_MASTS: Final = 5.0
"""An antenna higher than so many lengths of the hull would turn it over."""
_ASTERN: Final = 3.0
"""No propeller pulls so many times more astern than ahead, even mounted the wrong way round."""


def hull_mistakes(vessel: VesselConfig) -> list[str]:
    """What of a hull file cannot be meant, though each value alone is possible."""
    return [
        *_bulk(vessel),
        *_inertia(vessel),
        *_damping(vessel),
        *_below(vessel),
        *_above(vessel),
        *_thrusters(vessel),
        *_rudders(vessel),
        *_power(vessel),
    ]


def hull_warnings(vessel: VesselConfig) -> list[str]:
    """What may be meant of a hull file, and is more often a mistake that costs water under the keel, or the track."""
    return [*_hanging(vessel), *_undamped(vessel)]


def _hanging(vessel: VesselConfig) -> Iterator[str]:
    keel_m = vessel.keel_depth_m
    return (
        f"{key} = {depth_m:g}: the sounder would hang {_about(depth_m - keel_m)} m below the lowest point, keel_depth_m {keel_m:g}, and so "
        "much more water be told under the keel than there is under the sounder; on a pole it is the lowest point: keel_depth_m the same"
        for key, depth_m in _sounders(vessel).items()
        if depth_m > keel_m
    )


def _undamped(vessel: VesselConfig) -> Iterator[str]:
    hull = vessel.hull
    if hull.nur == 0.0 and hull.nr < _DAMPED_PER_S * hull.m33_kgm2:
        yield (
            f"hull.nur = 0 beside nr {_about(hull.nr)}: by this file nothing damps the boat's turning at cruise, and it is steered "
            f"softly; a turn on the spot shows nothing of nur: start from {_about(0.5 * _keel_line_nms(vessel))} (docs/VESSEL.md, step 5)"
        )


def _keel_line_nms(vessel: VesselConfig) -> float:
    """Yaw damping per m/s of way of a long keel line, slender-body theory."""
    lever = 0.5 * vessel.hull.draught_m * vessel.hull.length_m
    return RHO_WATER * lever * lever


def _sounders(vessel: VesselConfig) -> dict[str, float]:
    """Depth of each sounder below the waterline, m, by its key."""
    return {"transducer_depth_m": vessel.transducer_depth_m} | {
        f"mounts.{name}.transducer_depth_m": mount.transducer_depth_m or 0.0 for name, mount in vessel.mounts.items()
    }


def _about(value: float) -> str:
    """Three figures of it, as a person writes them."""
    return f"{float(f'{value:.3g}'):g}"


def _bulk(vessel: VesselConfig) -> Iterator[str]:
    hull = vessel.hull
    box_kg = RHO_WATER * hull.length_m * hull.beam_m * hull.draught_m
    size = f"{hull.length_m:g} x {hull.beam_m:g} x {hull.draught_m:g} m of water are {_about(box_kg)} kg"
    if hull.mass_kg > _FULLEST * box_kg:
        yield f"hull.mass_kg = {hull.mass_kg:g}: {size}, and carry no more; look at length_m, beam_m and draught_m too"
    if hull.mass_kg < _FINEST * box_kg:
        yield f"hull.mass_kg = {hull.mass_kg:g}: {size}, and she would not sink in so far; metres and kilograms are meant"
    if hull.beam_m > 1.5 * hull.length_m:
        yield f"hull.beam_m = {hull.beam_m:g}: more than one and a half times length_m {hull.length_m:g}; metres are meant"
    if hull.draught_m > hull.length_m:
        yield f"hull.draught_m = {hull.draught_m:g}: more than length_m {hull.length_m:g}; metres are meant"


def _inertia(vessel: VesselConfig) -> Iterator[str]:
    hull = vessel.hull
    for key, inertia_kg, usual in (("m11_kg", hull.m11_kg, 1.07), ("m22_kg", hull.m22_kg, 2.0)):
        if inertia_kg < _ADDED * hull.mass_kg:
            yield (
                f"hull.{key} = {inertia_kg:g}: less than mass_kg {hull.mass_kg:g}; it is the mass and the water that moves "
                f"along together, about {_about(usual * hull.mass_kg)}"
            )
    low, high = (hull.mass_kg * (share * hull.length_m) ** 2 for share in _GYRATION)
    if not low <= hull.m33_kgm2 <= high:
        about = 1.7 * hull.mass_kg * (0.25 * hull.length_m) ** 2
        yield (
            f"hull.m33_kgm2 = {hull.m33_kgm2:g}: no hull of {hull.length_m:g} m and {hull.mass_kg:g} kg turns so; about {_about(about)}"
        )
    elif hull.m23_kgm**2 >= hull.m22_kg * hull.m33_kgm2:
        most = math.sqrt(hull.m22_kg * hull.m33_kgm2)
        yield f"hull.m23_kgm = {hull.m23_kgm:g}: sway and yaw would feed each other; less than {_about(most)}, 0 when not known"


def _damping(vessel: VesselConfig) -> Iterator[str]:
    hull = vessel.hull
    if hull.xu < 1e-9:
        yield f"hull.xu = {hull.xu:g}: she would coast for ever; give a tenth of thrust over speed when it came out as nothing"
    if hull.yv + hull.yvv + hull.crossflow_cd == 0.0:
        yield "hull.yv = 0: nothing stops her from sliding sideways; give about m22_kg, and yvv (docs/VESSEL.md)"
    if hull.nr + hull.nrr + hull.nur == 0.0:
        yield "hull.nr = 0: nothing stops her from turning; give about m33_kgm2, and nrr (docs/VESSEL.md)"
    for key, inertia_key, most, unit in _QUICKEST:
        damping, inertia = getattr(hull, key), getattr(hull, inertia_key)
        if damping > most * inertia:
            yield (
                f"hull.{key} = {damping:g}: {_about(damping / inertia)} {unit} of {inertia_key} {inertia:g}, and no hull loses its "
                f"way so quickly; look for a digit too many in it, or too few in {inertia_key}"
            )


def _below(vessel: VesselConfig) -> Iterator[str]:
    hull, keel_m = vessel.hull, vessel.keel_depth_m
    if keel_m < 0.9 * hull.draught_m:
        yield f"keel_depth_m = {keel_m:g}: less than hull.draught_m {hull.draught_m:g}; it is the lowest point, the guard measures from it"
    if keel_m > hull.draught_m + hull.length_m:
        yield f"keel_depth_m = {keel_m:g}: a keel deeper than the hull of {hull.length_m:g} m is long; were centimetres meant?"
    for key, depth_m in _sounders(vessel).items():
        if depth_m < 0.0:
            yield f"{key} = {depth_m:g}: above the water a sounder hears nothing; the depth is positive down"
        if depth_m > max(keel_m, hull.draught_m) + hull.length_m:
            yield f"{key} = {depth_m:g}: deeper below the boat than she is long; were centimetres meant?"


def _above(vessel: VesselConfig) -> Iterator[str]:
    length_m = vessel.hull.length_m
    antennas = {"antenna": vessel.antenna}
    antennas |= {f"mounts.{name}.antenna": mount.antenna for name, mount in vessel.mounts.items() if mount.antenna}
    for table, antenna in antennas.items():
        for key, off_m in (("forward_m", antenna.forward_m), ("starboard_m", antenna.starboard_m)):
            if abs(off_m) > 2.0 * length_m:
                yield f"{table}.{key} = {off_m:g}: off a hull of {length_m:g} m; metres from its reference point are meant"
        if antenna.up_m > _MASTS * length_m:
            yield f"{table}.up_m = {antenna.up_m:g}: a mast that a hull of {length_m:g} m does not carry; were centimetres meant?"
        if antenna.up_m < 0.0:
            yield f"{table}.up_m = {antenna.up_m:g}: under the water no satellite is heard; metres above the waterline are meant"


def _thrusters(vessel: VesselConfig) -> Iterator[str]:
    hull, thruster = vessel.hull, vessel.thruster
    for key, width_m in (("lateral_m", thruster.lateral_m), ("diameter_m", thruster.diameter_m)):
        if width_m > hull.beam_m:
            yield f"thruster.{key} = {width_m:g}: more than hull.beam_m {hull.beam_m:g}; metres are meant"
    if thruster.lag_s > _LAG_S:
        yield f"thruster.lag_s = {thruster.lag_s:g}: no motor takes so long; were milliseconds meant?"
    if thruster.astern_n > _ASTERN * thruster.ahead_n:
        yield f"thruster.astern_n = {thruster.astern_n:g}: {thruster.astern_n / thruster.ahead_n:.3g} times ahead_n; about half is usual"
    if vessel.rudder.count == 0 and (thruster.count == 1 or thruster.lateral_m == 0.0):
        yield (
            f"thruster.count = {thruster.count}: without rudders and without a second thruster beside it nothing steers her; "
            "give [rudder] its count, or lateral_m of two thrusters"
        )


def _rudders(vessel: VesselConfig) -> Iterator[str]:
    hull, rudder = vessel.hull, vessel.rudder
    if rudder.count == 0:
        return
    if -rudder.x_m > hull.length_m:
        yield f"rudder.x_m = {rudder.x_m:g}: off a hull of {hull.length_m:g} m; metres from its middle are meant"
    side_m2 = hull.length_m * max(hull.draught_m, vessel.keel_depth_m)
    if rudder.area_m2 > side_m2:
        yield f"rudder.area_m2 = {rudder.area_m2:g}: more than the hull's own side under water, {side_m2:.2g}; were cm2 meant?"
    for key, angle_deg in (("max_deg", rudder.max_deg), ("stall_deg", rudder.stall_deg)):
        if angle_deg < _RADIANS_DEG:
            yield f"rudder.{key} = {angle_deg:g}: degrees; were radians meant ({math.degrees(angle_deg):.0f} degrees)?"
    if rudder.max_deg >= _RADIANS_DEG and rudder.max_deg / rudder.rate_dps > _STROKE_S:
        yield f"rudder.rate_dps = {rudder.rate_dps:g}: {rudder.max_deg / rudder.rate_dps:.0f} s to hard over; degrees a second are meant"
    if rudder.lag_s > _LAG_S:
        yield f"rudder.lag_s = {rudder.lag_s:g}: no servo takes so long; were milliseconds meant?"
    if abs(rudder.offset_deg) >= rudder.max_deg >= _RADIANS_DEG:
        yield f"rudder.offset_deg = {rudder.offset_deg:g}: not less than max_deg {rudder.max_deg:g}: they could never stand amidships"


def _power(vessel: VesselConfig) -> Iterator[str]:
    top_mps, (least, most) = top_speed_mps(vessel), _SPEEDS_MPS
    if vessel.hull.xu > 0.0 and not least <= top_mps <= most:
        yield (
            f"thruster.ahead_n = {vessel.thruster.ahead_n:g}: with this drag the top speed were {top_mps:.3g} m/s; "
            f"give newtons of one thruster, and look at hull.xu {vessel.hull.xu:g} and xuu {vessel.hull.xuu:g}"
        )
    side_m2 = 10.0 * vessel.hull.length_m**2
    for key, area_m2 in (("frontal_m2", vessel.windage.frontal_m2), ("lateral_m2", vessel.windage.lateral_m2)):
        if area_m2 > side_m2:
            yield f"windage.{key} = {area_m2:g}: a house on a hull of {vessel.hull.length_m:g} m; square metres are meant"

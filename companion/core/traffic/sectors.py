"""Who is what to whom: the roles of the collision regulations (rules 13 to 15) by bearing and aspect.

``beta`` is her bearing from our heading, ``alpha`` ours from hers, ``gamma`` the difference of the courses; to starboard positive.
A role is taken when risk begins and kept until past and clear: a later change of bearing changes nothing (rule 13 d).
"""

from __future__ import annotations

import math
from enum import Enum
from typing import Final, assert_never

from mavlink_bridge.language.traffic import Role
from mavlink_bridge.language.units import wrap_pi

_ABAFT: Final = math.radians(112.5)
"""22.5 degrees abaft the beam (rule 13 b)."""
_HEAD_ON_GAMMA: Final = math.radians(157.5)
_HEAD_ON_BETA: Final = math.radians(22.5)
"""Nearly reciprocal and nearly ahead; surely so within 15 degrees, in doubt up to 22.5 (rule 14 c)."""


class Duty(Enum):
    """What a role asks of us."""

    NONE = "none"
    GIVE_WAY = "give way"
    STAND_ON = "stand on"


def role_of(
    place_m: tuple[float, float], own_psi_rad: float, own_mps: float, her_course_rad: float, her_mps: float
) -> Role:
    """Return our role towards a vessel under way. ``place_m``: north and east from us to her."""
    bearing = math.atan2(place_m[1], place_m[0])
    beta = wrap_pi(bearing - own_psi_rad)
    alpha = wrap_pi(bearing + math.pi - her_course_rad)
    gamma = abs(wrap_pi(her_course_rad - own_psi_rad))
    if abs(alpha) > _ABAFT and own_mps > her_mps:
        return Role.OVERTAKING
    if abs(beta) > _ABAFT and her_mps > own_mps:
        return Role.OVERTAKEN
    if gamma >= _HEAD_ON_GAMMA and abs(beta) <= _HEAD_ON_BETA:
        return Role.HEAD_ON
    return Role.GIVE_WAY if beta > 0.0 else Role.STAND_ON


def duty_of(role: Role) -> Duty:
    """What the rules ask of us in a role."""
    match role:
        case Role.NONE | Role.OBSTACLE:
            return Duty.NONE
        case Role.HEAD_ON | Role.GIVE_WAY | Role.OVERTAKING:
            return Duty.GIVE_WAY
        case Role.STAND_ON | Role.OVERTAKEN:
            return Duty.STAND_ON
        case _:
            assert_never(role)

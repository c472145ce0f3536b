"""Who is what to whom: the roles of the collision regulations (rules 13 to 15) by bearing and aspect, and what each asks of us.

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
    NOT_IMPEDE = "do not impede"


class Hampered(Enum):
    """Whom a power-driven vessel, as we are, keeps clear of from whatever side she comes (rule 18 a, d)."""

    NOT_UNDER_COMMAND = "not under command"
    RESTRICTED = "restricted"
    BY_DRAUGHT = "constrained by draught"
    FISHING = "fishing"
    SAILING = "sailing"


_UNDEFINED: Final = 15
"""Navigational status that says nothing."""
_BY_STATUS: Final = {
    2: Hampered.NOT_UNDER_COMMAND,
    3: Hampered.RESTRICTED,
    4: Hampered.BY_DRAUGHT,
    7: Hampered.FISHING,
    8: Hampered.SAILING,
}
_BY_TYPE: Final = {
    30: Hampered.FISHING,
    31: Hampered.RESTRICTED,
    32: Hampered.RESTRICTED,
    33: Hampered.RESTRICTED,
    34: Hampered.RESTRICTED,
    36: Hampered.SAILING,
}
"""Fishing, towing, dredging, diving, sailing (ITU-R M.1371 table 53). A type is no activity, but who sends no status may be at it."""


def hampered_of(status: int | None, ship_type: int) -> Hampered | None:
    """Why a vessel need not keep clear of us; None: she is power-driven as we are. Her status says what she does, her type what she may."""
    return _BY_TYPE.get(ship_type) if status is None or status == _UNDEFINED else _BY_STATUS.get(status)


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


def duty_of(role: Role, hampered: Hampered | None = None) -> Duty:
    """What the rules ask of us in a role. Who overtakes keeps clear of us whatever she is (rule 13)."""
    match role:
        case Role.NONE | Role.OBSTACLE:
            return Duty.NONE
        case Role.HEAD_ON | Role.GIVE_WAY | Role.OVERTAKING:
            return Duty.GIVE_WAY
        case Role.STAND_ON if hampered is not None:
            return Duty.NOT_IMPEDE if hampered is Hampered.BY_DRAUGHT else Duty.GIVE_WAY
        case Role.STAND_ON | Role.OVERTAKEN:
            return Duty.STAND_ON
        case _:
            assert_never(role)

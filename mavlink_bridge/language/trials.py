"""What is asked of a sea trial, by which a vessel measures itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from .messages import Mode
from .nature import OTHER, Ask, Matter, Nature

TRIAL_DONE: Final = "Trial done"
TRIAL_ENDED: Final = "Trial ended"
NO_TRIAL: Final = "no sea trial is under way"
"""How the vessel's texts begin that say so: whoever stays with a trial knows its end by them."""


class TrialOrder(Enum):
    """What is asked of a sea trial."""

    END = "end"
    BEGIN = "begin"
    CONFIRM = "confirm"
    """A person has seen the first manoeuvres: whole throttle from now on."""
    TELL = "tell"
    """Say how it stands: what is done, what comes, how long."""
    LOOK = "look"
    """Say whether one may begin here, and begin none."""


_TRIAL: Final = frozenset((Matter.TRIAL,))


TRIAL_RADIUS_M: Final = 80.0
"""Of the circle that a trial keeps to where nobody says another: a steady run and its stop fit for boats of some metres."""


@dataclass(frozen=True, slots=True)
class SeaTrial(Ask):
    """The vessel measures itself: manoeuvres inside an area around where it is."""

    order: TrialOrder
    radius_m: float = TRIAL_RADIUS_M
    quick: bool = False
    fitted: bool = False
    """Where fence or chart leave less than the circle, the trial keeps to what they leave, as seen from here; else it is refused."""

    @property
    def nature(self) -> Nature:
        match self.order:
            case TrialOrder.BEGIN:
                return Nature(moves=True, decides=True, aim=(Mode.GUIDED, None), settles=_TRIAL)
            case TrialOrder.CONFIRM | TrialOrder.TELL | TrialOrder.LOOK:
                return OTHER
            case TrialOrder.END:
                return Nature(yields=False, settles=_TRIAL)
            case _ as never:
                assert_never(never)

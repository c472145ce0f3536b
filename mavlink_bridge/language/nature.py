"""What a request means to the safety of the boat, whatever it is about: said once, by the request itself, asked everywhere."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Final

from .messages import Mode
from .spoken import UNSPOKEN, Spoken

Aim = tuple[Mode | None, bool | None]
"""The mode that a request brings and whether the vessel is then armed; None for what it leaves as it is."""


class Matter(Enum):
    """What stays as a request said it until another says otherwise, beside mode and arming."""

    WAY = "where it goes"
    SPEED = "how fast"
    HOME = "home"
    FENCE = "the fence"
    HELM = "who commands"
    TRIAL = "the sea trial"


_MOVED: Final = frozenset((Matter.WAY, Matter.SPEED, Matter.HELM))
_STOPPED: Final = frozenset((Matter.WAY,))
_ARMED: Final = frozenset((Matter.HELM,))
_NOTHING: Final[frozenset[Matter]] = frozenset()


@dataclass(frozen=True, slots=True)
class Nature:
    """What a request means to the boat's safety, whatever it is about. Links, copies, failsafe and refusals all ask this."""

    stops: bool = False
    """Goes before everything else, is obeyed each time it comes, and may use what is kept of the air's hour."""
    moves: bool = False
    """Sets the boat under way by its own steering: refused while it must not."""
    decides: bool = False
    """A person has decided what the boat does: a failsafe whose cause is gone ends. A stream goes on by itself and is none."""
    sets: bool = False
    """Changes what stands: where plan and return lead, the fence, a parameter, kept logs, whether the program runs. It moves nothing
    by itself and may turn a boat that sails, or leave her deaf, so only who may command does it."""
    yields: bool = True
    """A stop that was given later makes it void, as it could set the boat going again."""
    aim: Aim = (None, None)
    settles: frozenset[Matter] = frozenset()
    """What stays as this request says it, until another one that reaches the same."""

    @property
    def reaches(self) -> frozenset[Matter]:
        """What is no longer as an earlier request settled it: an order that moves brings its own way and speed, and takes the helm."""
        return self.settles | (
            _MOVED if self.moves else _STOPPED if self.stops else _ARMED if self.aim[1] else _NOTHING
        )


SETTING: Final = Nature(yields=False)
OTHER: Final = Nature()


class Ask(ABC):
    """What all requests have. Each says its nature itself, so that no new one gets another's in silence."""

    __slots__ = ()

    spoken: ClassVar[Spoken | None] = UNSPOKEN
    """The plain command that asks for it, and whose row among the commands is made from this."""

    @property
    @abstractmethod
    def nature(self) -> Nature: ...

    @property
    def about(self) -> Hashable:
        """Which of several things of its kind it is about: what is asked of another one takes nothing back."""
        return None


def takes_back(later: Ask, earlier: Ask) -> bool:
    """Whether an order is contrary to one before it: who gave both wants the first no more, and means it anew if he gives it again.

    A stop and what sets the boat going are contrary to each other, whatever modes they bring. Two ways to go are, where each brings its
    mode; a speed or the next item leaves the go-to before it as it is.
    """
    if later == earlier:
        return False
    new, old = later.nature, earlier.nature
    if any(a is not None and b is not None and a is not b for a, b in zip(new.aim, old.aim, strict=True)):
        return True
    if (old.stops and (new.moves or new.aim[1])) or (new.stops and old.moves):
        return True
    is_alike = type(later) is type(earlier) and later.about == earlier.about
    bring_modes = new.aim[0] is not None and old.aim[0] is not None
    return bool(new.settles & old.settles) and (is_alike or bring_modes)

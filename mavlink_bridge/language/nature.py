"""What a request means to the safety of the boat, whatever it is about: said once, by the request itself, asked everywhere."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Final

from .messages import Mode
from .spoken import UNSPOKEN, Spoken

Aim = tuple[Mode | None, bool | None]
"""The mode that a request brings and whether the vessel is then armed; None for what it leaves as it is."""


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
    """Changes what stands: where plan and return lead, the fence, a parameter. It moves nothing by itself and may turn a boat that sails,
    so only who may command does it."""
    yields: bool = True
    """A stop that was given later makes it void, as it could set the boat going again."""
    aim: Aim = (None, None)


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

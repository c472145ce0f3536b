"""Which requests lead the vessel: who has one of them carried out commands from then on, on whatever link and through whatever gateway."""

from __future__ import annotations

from .messages import Mode
from .requests import Arm, ForgetDepth, ManualInput, RequestBody, SetCurrent, SetMode, SetSpeed, UnlockGuard


def leads(body: RequestBody, *, manual: bool) -> bool:
    """Whether a request sets the vessel going or changes where it goes: only who may command does that.

    What stops it or leads home is obeyed from everybody; sticks count while they steer (``manual``).
    """
    match body:
        case ManualInput():
            return manual
        case Arm():
            return body.arm
        case SetMode(mode=Mode.MANUAL) | SetSpeed() | SetCurrent() | UnlockGuard() | ForgetDepth():
            return True
        case SetMode(mode=Mode.RTL):
            return False
        case _:
            return body.nature.moves and not body.nature.stops

"""Which control loops may act: IMC's ControlLoops with its scope, and Abort, as the seed's controller obeyed them.

A manoeuvre enables loops under a scope number that only grows; orders of an older scope are late and are ignored. Abort
switches everything off at once and stays: an enable counts again only with a newer scope, after the operator re-armed.
"""

from __future__ import annotations

from enum import Flag


class Loop(Flag):
    """The loops that a steering law has."""

    NONE = 0
    HEADING = 1
    SPEED = 2
    BOTH = 3


class LoopControl:
    """State of the loops. Both are on at first: a vessel without manoeuvre supervision steers what it is given."""

    def __init__(self) -> None:
        self.active = Loop.BOTH
        self.aborted = False
        self._scope = -1
        self._rearmed = True

    def enable(self, loops: Loop, scope: int) -> bool:
        """Switch loops on; return False when the order is late, or an abort stands."""
        late = scope <= self._scope if self.aborted else scope < self._scope
        if late or not self._rearmed:
            return False
        self.active = loops if self.aborted else self.active | loops
        self.aborted, self._scope = False, scope
        return True

    def disable(self, loops: Loop, scope: int) -> bool:
        """Switch loops off; return False when the order is late."""
        if scope < self._scope:
            return False
        self.active &= ~loops
        self._scope = scope
        return True

    def abort(self) -> None:
        """Everything off, until a newer scope after a re-arm."""
        self.active, self.aborted, self._rearmed = Loop.NONE, True, False

    def rearm(self) -> None:
        """The operator has re-armed: from now on a newer scope may enable loops again."""
        self._rearmed = True

"""What guidance hands on in each tick."""

from __future__ import annotations

from mavlink_bridge.language.messages import Desired, PathControlState
from mavlink_bridge.language.value import value


@value
class GuidanceOutput:
    """One step's result."""

    desired: Desired
    path: PathControlState
    arrived: bool = False
    """A go-to's point is reached or passed."""
    on_path: bool = False
    """A loiter's path (or point) has been reached; stays true."""
    turns: float = 0.0
    """Laps sailed since then."""
    unable: str = ""
    """Why nothing sensible can be steered: the caller must stop the vessel. Empty when all is well."""
    holds: bool = False
    """A point is being kept: it has been reached, or is so near that a turn for it is made where the boat lies."""

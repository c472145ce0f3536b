"""What the estimator says of itself to those who judge whether the vessel may go on."""

from __future__ import annotations

from mavlink_bridge.language.value import value


@value
class PlaceFlags:
    """Of position and heading; names as in the failsafe table."""

    position_lost: bool = False
    heading_lost: bool = False
    position_frozen: bool = False
    """The receiver repeats one position although the vessel moves."""
    sources_disagree: bool = False
    """Two receivers are farther apart than both allow, for 5 s and more."""

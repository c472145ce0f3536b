"""What of other vessels the failsafe warns of. None of it moves or stops the boat."""

from __future__ import annotations

from mavlink_bridge.language.traffic import TrafficPicture
from mavlink_bridge.language.value import value


@value
class TrafficFlags:
    """Of the traffic watch."""

    traffic_close: bool = False
    """A vessel is within half of the wanted clearance, or will be within 20 s."""
    traffic_lost: bool = False
    """A vessel with risk has not been heard for three of her intervals."""
    ais_lost: bool = False
    """A receiver that was heard, or must be, has been silent for a minute."""
    person_in_water: bool = False
    """A beacon 970, 972 or 974 sends in earnest."""


def flags_of(picture: TrafficPicture) -> TrafficFlags:
    """Return what a picture of others warns of."""
    return TrafficFlags(
        traffic_close=picture.close,
        traffic_lost=picture.lost,
        ais_lost=picture.silent,
        person_in_water=picture.person,
    )

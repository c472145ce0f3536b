"""Whose words over the radio keep the loss of the ground station away, where several gateways hold the key.

The gateway through which somebody last set the boat going commands; the others watch, and their beacons count for nothing while
it may still speak. Before anybody has ordered all count: that is asked once for the boat, not at each gateway. A gateway that has
started anew is another one by its nonce; it is told from one that watches by this, that the commanding one has not spoken since.
Between its beacons whatever a gateway says is as good as one, for where two talk beacons meet on the air.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ..language.leading import leads
from ..language.requests import RequestBody
from .air.profile import LinkSettings

_KNOWN: Final = 16
"""More starts than there are gateways in an hour; who has the key shall not fill the memory."""
_BEACONS_MISSED: Final = 2
"""One is lost now and then; after a second one the commanding gateway is taken for silent, as its station's time-out does."""


@dataclass(slots=True)
class _Gateway:
    """One start of a gateway: when it was first heard, and when its beacon last said that its station is there; None = not now."""

    since_us: int
    station_us: int | None = None


class GatewayPresence:
    """Keeps which start of which gateway commands, and when its station was last there."""

    def __init__(self, settings: LinkSettings) -> None:
        self._silent_us = round(_BEACONS_MISSED * settings.beacon_s * 1e6)
        self.heard_us: int | None = None
        """When a station that counts was last there."""
        self._commander: bytes | None = None
        self._spoke_us = 0
        """When the commanding gateway last said anything."""
        self._gateways: dict[bytes, _Gateway] = {}
        """By the nonces of their starts, oldest first."""

    def spoke(self, gateway: bytes, now_us: int) -> None:
        """A frame of this start of a gateway came."""
        station_us = self._known(gateway, now_us).station_us
        if gateway == self._commander:
            self._spoke_us = now_us
        if station_us is not None and now_us - station_us <= self._silent_us:
            self.is_there(gateway, now_us)

    def beacon(self, gateway: bytes, now_us: int, *, has_station: bool) -> None:
        """A gateway says whether the station that commands through it is there."""
        self._known(gateway, now_us).station_us = now_us if has_station else None
        if has_station:
            self.is_there(gateway, now_us)

    def is_there(self, gateway: bytes, now_us: int) -> None:
        """A station is there, by a beacon or by what it asks for."""
        if self._counts(gateway, now_us):
            self.heard_us = now_us

    def obeyed(self, gateway: bytes, body: RequestBody, now_us: int) -> bool:
        """What was asked through a gateway is carried out. Returns whether it takes the command from another gateway by that.

        What stops the boat passes no command while somebody else is there to have it.
        """
        decides = body.nature.decides or body.nature.stops
        if not leads(body, manual=False) and not (decides and self._is_silent(now_us)):
            return False
        is_another = not self._counts(gateway, now_us)
        self._commander, self._spoke_us, self.heard_us = gateway, now_us, now_us
        return is_another

    def _is_silent(self, now_us: int) -> bool:
        return self._commander is None or self.heard_us is None or now_us - self.heard_us > self._silent_us

    def _counts(self, gateway: bytes, now_us: int) -> bool:
        """Whether its stations are the boat's: it commands, nobody does, or it may be the commanding one after a restart."""
        since_us = self._known(gateway, now_us).since_us
        return self._commander in (None, gateway) or since_us > self._spoke_us

    def _known(self, gateway: bytes, now_us: int) -> _Gateway:
        known = self._gateways.setdefault(gateway, _Gateway(now_us))
        while len(self._gateways) > _KNOWN:
            del self._gateways[next(iter(self._gateways))]
        return known

"""Who speaks to a link and is not heard there, for want of the key or of a line in the configuration: how he is received, and how
the operator hears of him without being flooded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.mavlink.endpoint.doorstep import Doorstep
from mavlink_bridge.mavlink.persona import EndpointConfig
from mavlink_bridge.mavlink.telemetry.streams import Composer
from mavlink_bridge.mavlink.wire.signing import FrameVerdict, SigningState

from .io.links import Link
from .io.links.link import Selective

TOLD_EVERY_US: Final = 60_000_000
"""One sentence a minute for all strangers together: who knocks without end must not fill the operator's screen."""

LOOK_US: Final = 1_000_000


class Strangers:
    """Tells of strangers, for all links of a vessel or a gateway, and makes what receives them on one link."""

    def __init__(self, say: Callable[[Severity, str], None]) -> None:
        self._say = say
        self._told_us: int | None = None

    def refused(self, endpoint: str, peer: str, why: str, now_us: int) -> None:
        """Somebody was not heard on an endpoint."""
        if self._told_us is None or now_us - self._told_us >= TOLD_EVERY_US:
            self._told_us = now_us
            self._say(Severity.WARNING, f"{endpoint}: {peer} is not heard: {why}")

    def look(self, links: Iterable[Link], now_us: int) -> None:
        """Tell of who speaks to a link that hears only whom its configuration names, with the line that would name him."""
        for link in links:
            url = link.take_stranger() if isinstance(link, Selective) else ""
            if url:
                self.refused(link.name, url.removeprefix("udp://"), f'to let it command write url = "{url}"', now_us)

    def doorstep(
        self, config: EndpointConfig, signing: SigningState, link_id: int, composer: Composer | None = None
    ) -> Callable[[str, bool], Doorstep] | None:
        """What receives whoever comes to an endpoint, by his name and whether he was invited; None where no proof is asked for."""
        if config.link_class != "signed":
            return None

        def receive(peer: str, invited: bool) -> Doorstep:
            def refused(verdict: FrameVerdict, now_us: int) -> None:
                self.refused(config.name, peer, verdict.value, now_us)

            return Doorstep(config, signing, link_id=link_id, invited=invited, composer=composer, on_refused=refused)

        return receive


class Lookout:
    """Looks once a second who speaks to a vessel's links unheard. It stands outside the vessel, as what it sees is no input of it."""

    def __init__(self, links: Sequence[Link], say: Callable[[Severity, str], None]) -> None:
        """``say`` records what it is told, where the run is recorded."""
        self._links, self._strangers = links, Strangers(say)
        self._due_us = 0

    def update(self, snapshot: Snapshot) -> None:
        """Look, when it is time."""
        if snapshot.t_us >= self._due_us:
            self._due_us = snapshot.t_us + LOOK_US
            self._strangers.look(self._links, snapshot.t_us)

    def close(self) -> None:
        """Nothing to give back."""

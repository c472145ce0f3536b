"""Who stands before a signed link without the key: how he is received, and how the operator hears of him without being flooded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.mavlink.endpoint.doorstep import Doorstep
from mavlink_bridge.mavlink.persona import EndpointConfig
from mavlink_bridge.mavlink.telemetry.streams import Composer
from mavlink_bridge.mavlink.wire.signing import SigningState, Verdict

TOLD_EVERY_US: Final = 60_000_000
"""One sentence a minute for all strangers together: who knocks without end must not fill the operator's screen."""


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

    def doorstep(
        self, config: EndpointConfig, signing: SigningState, link_id: int, composer: Composer | None = None
    ) -> Callable[[str, bool], Doorstep] | None:
        """What receives whoever comes to an endpoint, by his name and whether he was invited; None where no proof is asked for."""
        if config.link_class != "signed":
            return None

        def receive(peer: str, invited: bool) -> Doorstep:
            def refused(verdict: Verdict, now_us: int) -> None:
                self.refused(config.name, peer, verdict.value, now_us)

            return Doorstep(config, signing, link_id=link_id, invited=invited, composer=composer, on_refused=refused)

        return receive

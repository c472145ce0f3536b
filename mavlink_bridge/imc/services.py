"""The services of an Announce: addresses as URLs in one text, ``imc+udp://10.77.0.1:6001/;imc+tcp://10.77.0.1:6001/;``.

What a stranger's Announce says of addresses is never followed to another host than the one it came from: else anybody could
have a vessel's state poured over a third party.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Final

from .system import Udp

VERSION: Final = "5.4.31"
"""Of IMC. Nothing that is spoken here has changed since 5.4.2 of 2014, and no console looks at it."""
_UDP: Final = re.compile(r"imc\+udp://([0-9.]{7,15})(?::(\d{1,5}))?(?:/|$)")
_USUAL_PORT: Final = 6002
"""Of a system that names none."""
_LONGEST: Final = 4096
"""Characters of a services text that are looked at: some hundred addresses."""


def services_text(uid: int, udp: Iterable[Udp], tcp: Iterable[Udp] = ()) -> str:
    """What our Announce says. ``uid`` tells a console that we started anew, so it is the same as long as the process lives."""
    found = [f"usv://0.0.0.0/uid/{uid}", f"imc+info://0.0.0.0/version/{VERSION}"]
    found += [f"imc+udp://{place.host}:{place.port}/" for place in udp]
    found += [f"imc+tcp://{place.host}:{place.port}/" for place in tcp]
    return ";".join(found)


def where_to(services: str, source: str) -> Udp | None:
    """Where a system that announced itself from the host ``source`` wants its datagrams; None when it names no address.

    Its own address among several is the one that the packet came from; a port told for another of its addresses serves too.
    """
    told = _addresses(services[:_LONGEST])
    port = next((each.port for each in told if each.host == source), told[0].port if told else 0)
    return Udp(source, port) if port else None


def _addresses(services: str) -> Sequence[Udp]:
    pairs = [found.groups() for part in services.split(";") if (found := _UDP.match(part))]
    places = [Udp(host, int(port) if port else _USUAL_PORT) for host, port in pairs]
    return [place for place in places if 0 < place.port <= 0xFFFF]

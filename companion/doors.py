"""Every socket that a process opens, from its settings: whom it hears, what may be done through it. Told at start and by ``check``.

This is the list that an owner compares with a scan of the boat's ports; ``tests/e2e/test_two_hosts.py`` compares it with one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Final

from mavlink_bridge.language.value import value

from .io.links import LinkConfigError, Reach, kind_of, parse_link_url
from .io.links.url import LinkUrl
from .security import is_local
from .settings import Settings
from .settings.schema import EndpointSettings

if TYPE_CHECKING:
    from .gateway import GatewaySettings

_MAY: Final = {
    "trusted": "obeys every order of whom it hears, unsigned",
    "signed": "obeys orders signed with the key, nothing else",
    "telemetry": "tells everything, obeys nobody",
}
"""What may be done on an endpoint, by its class."""


@value
class Door:
    """One socket."""

    name: str
    """Of the link, as in the configuration."""
    address: str
    """Kind, own address and port."""
    reach: str
    """Who is heard there."""
    link_class: str
    """Of an endpoint; else what hangs on the link: sensor, board, radio, plotter."""
    may: str
    """What may be done there."""

    @property
    def line(self) -> str:
        """All of it for people."""
        return f"{self.name}: {self.address}; {self.reach}; {self.link_class}: {self.may}"


def vessel_doors(settings: Settings) -> list[Door]:
    """Every socket of the vessel's process. What hangs on a wire has none."""
    found = [_door(item.name, item.url, "sensor", "is believed what it measures") for item in settings.sensors]
    found.append(_door("actuators", settings.actuators.url, "board", "is driven, and believed what it tells"))
    found += _stations(settings.endpoints)
    radio = settings.radio
    obeys = "obeys orders with the radio's key" if radio.protocol == "compact" else "obeys every order, without a key"
    found.append(_door("radio", radio.url, "radio", obeys))
    found.append(_door("plotter", settings.plotter, "plotter", "reads the sensors' sentences, says nothing"))
    return [door for door in found if door is not None]


def page_door(settings: Settings, port: int | None = None) -> Door:
    """The socket of the page's own process, ``companion web``, which runs only where somebody starts it."""
    page = settings.page
    local = page.bind in ("127.0.0.1", "::1", "localhost")
    reach = "programs on this computer" if local else "EVERY MACHINE that reaches this computer"
    may = (
        "tells everything, obeys Hold and Disarm with the page's key"
        if page.key_file
        else "tells everything, obeys nobody"
    )
    return Door("page", f"TCP {page.bind} port {port or page.port}", reach, "page", may)


def gateway_doors(settings: GatewaySettings) -> list[Door]:
    """Every socket of a gateway."""
    modem = _door("modem", settings.url, "radio", "is believed with the radio's key")
    return [door for door in (modem, *_stations(settings.endpoints)) if door is not None]


def served_doors(links: Iterable[tuple[str, str]]) -> list[Door]:
    """Sockets of simulated devices, each given as (name, address)."""
    found = [_door(name, url, "simulated device", "is served a simulation, says nothing") for name, url in links]
    return [door for door in found if door is not None]


def _stations(endpoints: Iterable[EndpointSettings]) -> Iterator[Door | None]:
    for item in endpoints:
        yield _door(item.name, item.url, item.link_class, _MAY[item.link_class])


def _door(name: str, url: str, link_class: str, may: str) -> Door | None:
    """The socket that a link opens; None when it opens none, or its address cannot be meant."""
    try:
        parsed = parse_link_url(url)
        found = _reach(parsed, local=is_local(url))
    except LinkConfigError:
        return None
    return None if found is None else Door(name, *found, link_class, may)


def _reach(parsed: LinkUrl, *, local: bool) -> tuple[str, str] | None:
    """Own address, and who is heard there."""
    kind = kind_of(parsed)
    if not kind.transport:
        return None
    host, port = parsed.host_port()
    transport = kind.transport.upper()
    match kind.reach:
        case Reach.CALLED:
            own = ("[::1]" if ":" in host else "127.0.0.1") if local else "any address"
            local_port = parsed.options.get("local", "0")
            free = f"port {local_port}" if local_port != "0" else "a free port"
            calls = ", which is called" if kind.transport == "tcp" else ""
            return f"{transport} {own}, {free}", f"{host}:{port} only{calls}"
        case Reach.NETWORK:
            return f"{transport} any address, a free port", f"everybody in the network of {host}"
        case Reach.ANYBODY:
            others = "programs on this computer" if local else "EVERY MACHINE that reaches this computer"
            return f"{transport} {host or '0.0.0.0'} port {port}", others
        case Reach.WIRED | Reach.HERE:
            return None

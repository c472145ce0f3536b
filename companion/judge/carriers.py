"""Links held against what they are for: what a kind of link can give, and how much a line carries."""

from __future__ import annotations

import errno
import ipaddress
import socket
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from .. import security
from ..io.links import LinkConfigError, Reach, kind_of, parse_link_url
from ..io.links.url import LinkUrl
from ..radio import load_radio
from ..settings import ConfigError, Settings

_LINE_BITS: Final = 10
"""A byte on a serial line, with its start and stop."""
_NMEA_BAUD: Final = 4800
"""The slowest line of NMEA 0183: a compass' sentences of one second fill half of it."""
_LAN_BYTES_S: Final = 1000
"""What profile "lan" sends by itself, 900 measured over a minute of the simulator, and a tenth for answers."""
_PLAIN_BITS_S: Final = 3000.0
"""The lowest air rate at which a station's own MAVLink goes through at all (docs/LORA.md)."""
_RESERVED_PORTS: Final = Path("/proc/sys/net/ipv4/ip_unprivileged_port_start")


def carrier_mistakes(settings: Settings) -> list[str]:
    """Links of a kind that cannot be what they are for."""
    return [*_recordings(settings), *_open_board(settings), *_budgets(settings)]


def carrier_warnings(settings: Settings) -> list[str]:
    """Lines too slow for what goes over them, and addresses that this computer cannot listen at."""
    return [*_slow_sensors(settings), *_slow_stations(settings), *_air(settings), *_not_ours(settings)]


def _parsed(url: str, baud: int | None = None) -> LinkUrl | None:
    """An address taken apart; None for one that is told as wrong elsewhere."""
    try:
        parsed = parse_link_url(url, {} if baud is None else {"baud": baud}) if url else None
        return parsed if parsed is not None and kind_of(parsed) else None
    except LinkConfigError:
        return None


def _rate(parsed: LinkUrl | None) -> int:
    """Bits a second of a serial line, where they are said; else 0."""
    said = str(parsed.options.get("baud", "")) if parsed is not None and parsed.scheme == "serial" else ""
    return int(said) if said.isascii() and said.isdigit() else 0


def _recordings(settings: Settings) -> Iterator[str]:
    """A recording is read: whoever is spoken to must hear."""
    links = [
        ("actuators.url", settings.actuators.url),
        ("radio.url", settings.radio.url),
        ("plotter", settings.plotter),
    ]
    links += [(f"endpoints.{number}.url", item.url) for number, item in enumerate(settings.endpoints)]
    for key, url in links:
        parsed = _parsed(url)
        if parsed is not None and parsed.scheme == "file":
            yield f"{key} = {url!r}: is a recording, and hears nothing; a file can only be a sensor: give a device or an address"


def _open_board(settings: Settings) -> Iterator[str]:
    """Whoever speaks first would be the board, and get its commands."""
    url = settings.actuators.url
    if _parsed(url) is None:
        return
    try:
        is_open = security.is_open_listener(url)
    except LinkConfigError:
        return
    if is_open:
        yield f"actuators.url = {url!r}: whoever speaks to this port would be the board; call it: serial:/dev/..., or tcp://host:port"


def _budgets(settings: Settings) -> Iterator[str]:
    for number, item in enumerate(settings.endpoints):
        carries = _rate(_parsed(item.url)) // _LINE_BITS
        if item.budget_bytes_per_s and 0 < carries < item.budget_bytes_per_s:
            yield (
                f"endpoints.{number}.budget_bytes_per_s = {item.budget_bytes_per_s}: the line carries {carries} bytes/s; "
                "less, or a faster line"
            )


def _slow_sensors(settings: Settings) -> Iterator[str]:
    for number, item in enumerate(settings.sensors):
        rate = _rate(_parsed(item.url, item.baud))
        if 0 < rate < _NMEA_BAUD:
            yield f"sensors.{number}.url = {item.url!r}: {rate} baud carry no compass' sentences; NMEA 0183 begins at {_NMEA_BAUD}"


def _slow_stations(settings: Settings) -> Iterator[str]:
    """A line that what is sent by itself fills: answers come late or never."""
    for number, item in enumerate(settings.endpoints):
        carries = _rate(_parsed(item.url)) // _LINE_BITS
        if item.profile == "lan" and not item.budget_bytes_per_s and 0 < carries < _LAN_BYTES_S:
            yield (
                f'endpoints.{number}.profile = "lan": sends about {_LAN_BYTES_S} bytes/s, and the line carries {carries}; '
                'profile = "lora", or a faster line'
            )


def _air(settings: Settings) -> Iterator[str]:
    """The radio's module speaks at one rate on its port, and carries another on the air."""
    radio = settings.radio
    try:
        profile = load_radio(radio.profile) if radio.url else None
    except ConfigError:
        return
    if profile is None:
        return
    rate = _rate(_parsed(radio.url))
    if rate not in (0, profile.baud):
        yield f"radio.url = {radio.url!r}: {rate} baud, and profile {radio.profile!r} has its module at {profile.baud}"
    if radio.protocol == "mavlink" and profile.air_rate < _PLAIN_BITS_S:
        yield (
            f"radio.protocol = 'mavlink': a station's own heartbeats fill the {profile.air_rate:g} bit/s of profile {radio.profile!r}; "
            "profile = 'plain-10', or protocol = 'compact'"
        )


def _not_ours(settings: Settings) -> Iterator[str]:
    """Doors that this computer cannot open now: an address that another has, a port that is kept for root."""
    doors = [(f"endpoints.{number}.url", item.url) for number, item in enumerate(settings.endpoints)]
    doors += [(f"sensors.{number}.url", item.url) for number, item in enumerate(settings.sensors)]
    yield from closed_doors([*doors, ("plotter", settings.plotter)])
    if "page" in settings.model_fields_set:
        yield from _closed(
            f"page.bind = {settings.page.bind!r}", settings.page.bind, 0, "the page does not start until it has"
        )
        yield from _closed(f"page.port = {settings.page.port}", "", settings.page.port, "")


def closed_doors(doors: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Those of links, each given as (key, address)."""
    for key, url in doors:
        parsed = _parsed(url)
        if parsed is not None and kind_of(parsed).reach is Reach.ANYBODY:
            yield from _closed(f"{key} = {url!r}", *parsed.host_port(), "nobody is heard there until it has")


def _closed(shown: str, host: str, port: int, then: str) -> Iterator[str]:
    if _is_foreign(host):
        yield f"{shown}: this computer has no such address now; {then}; 0.0.0.0 listens at all that it has"
    if _is_strange(host):
        yield f"{shown}: {host!r} is not this computer's name; give an address that it has, or 0.0.0.0 for all"
    first = int(_RESERVED_PORTS.read_text()) if _RESERVED_PORTS.exists() else 0
    if 0 < port < first:
        yield f"{shown}: ports below {first} are for root, and the service is not; choose another port"


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _is_strange(host: str) -> bool:
    """Whether a name is not this computer's. Nobody is asked for it: that may take its time."""
    if not host or _is_address(host):
        return False
    return _first(host) not in ("localhost", _first(socket.gethostname()))


def _first(host: str) -> str:
    return host.partition(".")[0].lower()


def _is_foreign(host: str) -> bool:
    """Whether an address is another computer's, or of an interface that is not up."""
    if not _is_address(host):
        return False
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as trial:
        try:
            trial.bind((host, 0))
        except OSError as error:
            return error.errno == errno.EADDRNOTAVAIL
    return False

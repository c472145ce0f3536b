"""Addresses held against each other: one device or port serves one purpose, and nobody talks to himself."""

from __future__ import annotations

import ipaddress
import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..io.links import LinkConfigError, LinkKind, Reach, kind_of, parse_link_url
from ..io.links.url import LinkUrl

_ANY: Final = frozenset({"", "0.0.0.0", "::", "*"})


@dataclass(frozen=True, slots=True)
class _Use:
    """One link: what it is for, and what it takes."""

    key: str
    url: str
    parsed: LinkUrl

    @property
    def kind(self) -> LinkKind:
        return kind_of(self.parsed)

    @property
    def device(self) -> str:
        """The device or file behind a link; its stable name and its usual one are the same device."""
        if self.kind.is_path:
            path = self.parsed.path() if self.parsed.where else ""
            return os.path.realpath(path) if path and "RUN_DIR" not in path else path
        return ""

    @property
    def place(self) -> tuple[str, int]:
        host, port = self.parsed.host_port()
        return "127.0.0.1" if host == "localhost" else host, port

    @property
    def heard_at(self) -> int:
        """The port at which a link that calls hears its answers, where the address says one; else 0."""
        said = self.parsed.options.get("local", "0")
        return int(said) if said.isascii() and said.isdigit() else 0


def collisions(wanted: Sequence[tuple[str, str]]) -> list[str]:
    """Return what cannot be meant of links, each given as (key, address); a wrong address is somebody else's to tell."""
    uses: list[_Use] = []
    found: list[str] = []
    for key, url in wanted:
        if not url:
            continue
        try:
            use = _Use(key, url, parse_link_url(url))
            problem = _nowhere(use)
            clash = "" if problem else next(filter(None, (_clash(use, other) for other in uses)), "")
        except (LinkConfigError, ValueError):
            continue
        if problem or clash:
            found.append(f"{key} = {url!r}: {problem or clash}")
        uses.append(use)
    return found


def _nowhere(use: _Use) -> str:
    """Why nobody can be reached at an address."""
    if use.parsed.scheme == "file" and use.device and not Path(use.device).exists():
        return "no such file; give the file to be read"
    if use.parsed.scheme == "serial":
        return _no_port(use.parsed.path())
    if use.kind.reach is not Reach.CALLED:
        return ""
    host, port = use.place
    if port == 0:
        return "port 0 is nobody's; give the port of the other side"
    if host in _ANY:
        return f"{host or 'no host'} is nobody's address; give the other side's, or listen with {use.parsed.scheme}-listen://"
    if use.heard_at == port and _is_own(host):
        return f"calls the port {port} at which it hears: only itself; give the other side's port, or leave out local"
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return "is no address: four numbers from 0 to 255" if host.replace(".", "").isdigit() else ""
    if address == ipaddress.ip_address("255.255.255.255"):
        return "is everybody's address; give one station's, or udp-broadcast:// with the network's"
    return "is a group's address, and groups are not spoken to; give one station's" if address.is_multicast else ""


def _no_port(path: str) -> str:
    """Why a path can never be a serial port; one that is not there yet may be plugged in."""
    if os.name == "nt" or "RUN_DIR" in path:
        return ""
    if not path.startswith("/"):
        return f"a device has its whole path; was /dev/{path} meant?"
    try:
        mode = Path(path).stat().st_mode
    except OSError:
        return ""
    is_port = stat.S_ISCHR(mode) and os.path.realpath(path) != os.devnull
    return "" if is_port else "is no serial port; 'ls /dev/serial/by-id' lists those that are plugged in"


def _clash(use: _Use, other: _Use) -> str:
    if use.device or other.device:
        return (
            f"{other.key} has this device already; one device serves one purpose" if use.device == other.device else ""
        )
    if use.kind.transport != other.kind.transport or not use.kind.transport:
        return ""
    reaches = use.kind.reach, other.kind.reach
    if reaches == (Reach.CALLED, Reach.CALLED) and use.place == other.place:
        return f"{other.key} speaks to this address already; give each its own port"
    if use.heard_at and use.heard_at == other.heard_at:
        return f"{other.key} hears at port {use.heard_at} already; give each its own local port"
    for caller, listener in ((use, other), (other, use)):
        if caller.heard_at and (listener.kind.reach, listener.place[1]) == (Reach.ANYBODY, caller.heard_at):
            return f"{other.key} has port {caller.heard_at} already; give each its own"
        pair = caller.kind.reach, listener.kind.reach
        if pair == (Reach.CALLED, Reach.ANYBODY) and _reaches(caller.place, listener.place):
            return f"speaks to {other.key} of this very program, which is no station; give the other side's port"
    return ""


def _reaches(called: tuple[str, int], heard: tuple[str, int]) -> bool:
    """Whether who calls an address of this computer gets the program's own listening port."""
    if called[1] != heard[1] or called[1] == 0:
        return False
    return called[0] == heard[0] or (_is_own(called[0]) and heard[0] in _ANY)


def _is_own(host: str) -> bool:
    """Whether an address is this computer's own for sure."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False

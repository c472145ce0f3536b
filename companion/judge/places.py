"""Files, folders and names that cannot serve as what a configuration takes them for."""

from __future__ import annotations

import ipaddress
import os
import socket
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from ..io.links import LinkConfigError, parse_link_url
from ..settings import Settings

_SYSTEM: Final = frozenset(
    ["/", "/bin", "/boot", "/dev", "/etc", "/lib", "/proc", "/run", "/sbin", "/sys", "/usr", "/var"]
)
"""A service's user may not write there, root should not; most of it is not kept, or not a disk."""

_NAME_BYTES: Final = 220
"""Disks take 255; journals, a new file and one that was set aside have the same name and more."""
_PATH_BYTES: Final = 3800
"""Linux takes 4095; a run's own folder and its files come behind."""


def place_mistakes(settings: Settings) -> list[str]:
    """Where the store and the runs cannot be, keys that serve two purposes, and a page that cannot be served."""
    return [*_places(settings), *_one_key_each(settings), *_page(settings)]


def file_mistakes(settings: Settings, path: Path) -> list[str]:
    """A store that is a file which the configuration, at ``path``, is made of."""
    return _another_file(
        settings.store,
        {
            "this very configuration": str(path),
            "the hull file": settings.vessel if settings.vessel.endswith(".toml") else "",
            "security.key_file": settings.security.key_file,
            "radio.key_file": settings.radio.key_file,
            "page.key_file": settings.page.key_file,
            "depth.map.file": str(settings.depth.map.file or ""),
        },
    )


def store_mistakes(store: str, named: Mapping[str, str]) -> list[str]:
    """Where a store cannot be, and which file it would take from another; ``named``: what those files are for, by that."""
    return [*_place("store", store), *_another_file(store, named)]


def _another_file(store: str, named: Mapping[str, str]) -> list[str]:
    """The store takes a file for its own and moves aside what is damaged: never one that is named for something else."""
    if not store:
        return []
    real = os.path.realpath(store)
    taken = [what for what, name in named.items() if name and os.path.realpath(name) == real]
    return [f"store = {store!r}: is {what}; give the store a file of its own" for what in taken[:1]]


def _places(settings: Settings) -> Iterator[str]:
    """Files and folders that cannot be where they are said to be."""
    store, runs = settings.store, settings.record.directory
    yield from _place("store", store)
    yield from _place("record.directory", runs, is_folder=True)
    if settings.record.enabled and not runs.strip():
        yield "record.directory = '': is empty; name a folder, or set record.enabled = false"
    elif store and runs == store:
        yield f"record.directory = {runs!r}: is the store's file; give the runs a folder of their own"


def _place(key: str, place: str, *, is_folder: bool = False) -> Iterator[str]:
    """Why a file or folder of one's own cannot be there; where none is named nothing is kept."""
    kind = "folder" if is_folder else "file"
    if not place:
        return
    if place.startswith("~"):
        yield f"{key} = {place!r}: ~ is not your home here; write the whole path"
    elif "$" in place or "%" in place:
        yield f"{key} = {place!r}: nothing is put in for $ or % here; write the whole path"
    elif "://" in place:
        yield f"{key} = {place!r}: is no place on this computer; give a path"
    elif too_long := _too_long(place):
        yield f"{key} = {place[:20] + '...'!r}: {too_long}"
    elif Path(place).is_absolute() and Path(place).exists() and not (Path(place).is_file() or Path(place).is_dir()):
        yield f"{key} = {place!r}: is a device; nothing is kept there: name a {kind}"
    elif os.path.realpath(place if is_folder else Path(place).parent) in _SYSTEM:
        yield f"{key} = {place!r}: belongs to the system; name a {kind} of the boat's own"
    if not is_folder and place.endswith("/"):
        yield f"{key} = {place!r}: is a folder; name a file"
    if not is_folder and place.startswith(":"):
        yield f'{key} = {place!r}: would be a file of that name; {key} = "" keeps plans in memory only'


def _too_long(place: str) -> str:
    """Why no disk has such a name, with room for what stands beside it; empty when one has."""
    longest = max(len(os.fsencode(part)) for part in place.split("/"))
    if longest > _NAME_BYTES:
        return f"a name of {longest} bytes; {_NAME_BYTES} is the most"
    whole = len(os.fsencode(Path(place).absolute()))
    return f"a path of {whole} bytes; {_PATH_BYTES} is the most" if whole > _PATH_BYTES else ""


def _one_key_each(settings: Settings) -> Iterator[str]:
    """Who finds out one key must not have the others; on the page a telephone holds it."""
    keys = {"the MAVLink links": settings.security.key_file, "the radio": settings.radio.key_file}
    for key, name, others in (
        ("radio.key_file", settings.radio.key_file, ("the MAVLink links",)),
        ("page.key_file", settings.page.key_file, ("the MAVLink links", "the radio")),
    ):
        owner = next((other for other in others if name and keys[other] == name), "")
        if owner:
            yield f"{key} = {name!r}: is the key of {owner} too; make one for each"


def _page(settings: Settings) -> Iterator[str]:
    page = settings.page
    problem = _no_address(page.bind)
    if problem:
        yield f"page.bind = {page.bind!r}: {problem}"
    for number, item in enumerate(settings.endpoints):
        if "page" in settings.model_fields_set and _port(item.url) == page.port != 0:
            yield f"page.port = {page.port}: endpoints.{number} listens on it; choose another port"
    for name in page.names:
        if not name or any(char in "/:" or char.isspace() for char in name):
            yield f"page.names: {name!r} is no name as browsers send it; give it bare, as boat.example"


def _port(url: str) -> int:
    """The TCP port at which a link listens; 0 for none."""
    try:
        parsed = parse_link_url(url)
        return parsed.host_port()[1] if parsed.scheme == "tcp-listen" else 0
    except LinkConfigError:
        return 0


def _no_address(bind: str) -> str:
    """Why nothing can be served at an address."""
    try:
        ipaddress.ip_address(bind)
    except ValueError:
        host, colon, port = bind.rpartition(":")
        if colon and port.isdigit():
            return f"the port has a key of its own: bind = {host!r}, port = {port}"
        if bind in {name for _, name in socket.if_nameindex()}:
            return "is an interface; give the address that it has, or 0.0.0.0 for all"
        if not bind or bind.replace(".", "").isdigit() or any(char.isspace() or char == "/" for char in bind):
            return "is no address; give 127.0.0.1, an address of this computer, or 0.0.0.0 for all"
    return ""

"""Signing of a vessel's links: one key and one memory of time stamps for all of them, and no open door without a decision.

A link that other machines can reach is served only with signing, or for telemetry alone, or when the configuration says
``insecure = true``, which every ground station is told. Time stamps come from the store, from this computer's clock at the start and
from GNSS (forward only, once, while disarmed; where neither store nor clock brought one, by any step and under arms too). Where
GNSS shows that the time was not known until then, nothing older than its time less ``NEW_STREAM_BEHIND`` is accepted from there on:
what opened a stream before may have been recorded. Stamps are saved at shutdown, every 10 s and at a leap, so that what was accepted
before a restart is not accepted again. Source: firmware-reliability §B.3 and row 50.
"""

from __future__ import annotations

import ipaddress
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.witness import Witness
from mavlink_bridge.mavlink.wire.signing import NEW_STREAM_BEHIND, UNITS_PER_S, SigningState, units_from_utc

from .io.clock import EARLIEST_UTC_US
from .io.keeping import AnyStore
from .io.keeping.content import SaveStamp, Together
from .io.keeping.keys import KeyFileError, fingerprint, read_key, write_key
from .io.keeping.mark import WorldKind
from .io.links import LinkConfigError, Reach, check_link, kind_of, parse_link_url
from .settings import ConfigError
from .settings.schema import EndpointSettings, SecurityConfig, Settings

SAVE_US: Final = 10_000_000
LEAP: Final = UNITS_PER_S
"""A station whose clock is so far ahead of the time that was saved moves ours; that is saved at once."""
MARGIN_S: Final = SAVE_US / 1e6 + LEAP / UNITS_PER_S
"""After a loss of power the newest saved stamp may be so much older than the newest accepted one."""
MAX_GNSS_STEP: Final = 400 * 86_400 * UNITS_PER_S
"""How far GNSS may move a time that the store or this computer's clock brought: longer than a winter ashore."""
OWN: Final = "own"
FLOOR: Final = "floor"
CLEAN: Final = "clean"
"""1: the stamps were saved at shutdown, nothing was accepted after them."""
log = logging.getLogger(__name__)


class Secured(Protocol):
    """A configuration with links to ground stations: the vessel's, or a gateway's."""

    @property
    def security(self) -> SecurityConfig: ...
    @property
    def endpoints(self) -> tuple[EndpointSettings, ...]: ...


def is_local(url: str) -> bool:
    """True when only this machine, or what is wired to it, can reach the link. Raises LinkConfigError."""
    parsed = parse_link_url(url)
    match kind_of(parsed).reach:
        case Reach.WIRED | Reach.HERE:
            return True
        case Reach.NETWORK:
            return False
        case Reach.CALLED | Reach.ANYBODY:
            return _is_own(parsed.host_port()[0])


def _is_own(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_open_listener(url: str) -> bool:
    """True when other machines can speak to the link uninvited. Raises LinkConfigError."""
    return kind_of(parse_link_url(url)).reach in (Reach.ANYBODY, Reach.NETWORK) and not is_local(url)


def mistakes(settings: Secured, *, keys: bool = True) -> list[str]:
    """What must be mended before the links may be opened, each with its key and the mend. ``keys`` False: none is needed."""
    found: list[str] = []
    key = _key_problem(settings) if keys else ""
    if key:
        found.append(f"security.key_file = {settings.security.key_file!r}: {key}")
    for number, item in enumerate(settings.endpoints):
        problem = _problem(item, has_key=bool(settings.security.key_file))
        if problem:
            found.append(f"endpoints.{number}.{problem}")
    return found


def open_devices(settings: Settings) -> list[tuple[str, str, bool]]:
    """What of a vessel's devices anybody may speak as: key, what that means, whether the owner has said that he knows."""
    found = [
        (f"sensors.{number}", f"{item.url} ({item.name}) believes whoever sends where the boat is", item.insecure)
        for number, item in enumerate(settings.sensors)
        if is_open_listener(item.url)
    ]
    radio = settings.radio
    if radio.url and radio.protocol != "compact" and kind_of(parse_link_url(radio.url)).reach is not Reach.HERE:
        told = f'protocol = "{radio.protocol}" has no key: whoever transmits on the channel commands the boat'
        found.append(("radio", told, radio.insecure))
    return found


def device_mistakes(settings: Settings) -> list[str]:
    """Devices that others may pretend to be, without the owner's word for it."""
    mends = {"radio": 'protocol = "compact" with a key_file', "sensors": "a serial or tcp:// link"}
    try:
        found = open_devices(settings)
    except LinkConfigError:
        return []  # told by the check of links
    return [
        f"{key}: {told}; use {mends[key.partition('.')[0]]}, or set insecure = true"
        for key, told, known in found
        if not known
    ]


def _key_problem(settings: Secured) -> str:
    if not settings.security.key_file:
        return ""
    try:
        read_key(Path(settings.security.key_file))
    except KeyFileError as error:
        return str(error)
    return ""


def _problem(item: EndpointSettings, *, has_key: bool) -> str:
    if item.link_class == "signed" and not has_key:
        return "link_class = 'signed': needs security.key_file; make a key with 'companion keys make'"
    try:
        check_link(item.url)
        open_to_others = not is_local(item.url)
    except LinkConfigError:
        return ""  # told by the check of links
    if open_to_others and item.link_class == "trusted" and not item.insecure:
        return (
            f'url = {item.url!r}: can be reached by other machines; set link_class = "signed" with security.key_file, '
            'link_class = "telemetry" to listen to nobody, or insecure = true'
        )
    return ""


def open_doors(settings: Secured) -> list[str]:
    """Names of the endpoints on which anybody may give orders."""
    return [
        item.name
        for item in settings.endpoints
        if item.insecure and item.link_class == "trusted" and not is_local(item.url)
    ]


class Keeper:
    """Holds the signing state of a vessel or a gateway, keeps its stamps in the store, and takes a new key."""

    def __init__(
        self,
        settings: Secured,
        store: AnyStore,
        say: Callable[[Severity, str], None],
        started_utc_us: int,
        witness: Witness | None = None,
    ) -> None:
        witness = witness or Witness()
        found = mistakes(settings, keys=witness.placeholder is None)
        if found:
            raise ConfigError("security", found)
        self._path = Path(settings.security.key_file) if settings.security.key_file else None
        self.state = SigningState(
            (witness.placeholder or read_key(self._path)) if self._path else None, witness=witness
        )
        self._store = store
        self._say = say
        self._doors = tuple(open_doors(settings))
        self._is_blank = OWN not in store.snapshot().stamps and started_utc_us < EARLIEST_UTC_US
        """Nothing tells the time: until GNSS does, what is old cannot be told from what is new."""
        self._restore()
        self.state.advance(started_utc_us)
        self._base: int | None = None
        self._saved = self._saved_us = 0
        """The own stamp as it was last saved, and when."""
        self._gnss_done = False
        self._warned = False

    def tick(self, now_us: int, snapshot: Snapshot | None) -> bool:
        """Let the stamp grow with time, take GNSS time once, save. ``snapshot`` None: nothing is heard from the vessel.

        Return whether the time has become known only now: who proved himself before must do so again.
        """
        if not self._warned:
            self._warned = True
            self._warn()
        if self.state.key is None:
            return False
        if self._base is None:
            self._base = self.state.timestamp - now_us // 10
            self._save(now_us)
        self.state.timestamp = max(self.state.timestamp, self._base + now_us // 10)
        is_late, floor = snapshot is not None and snapshot.armed and not self._is_blank, self.state.floor
        utc_us = None if snapshot is None or is_late else snapshot.utc_us
        if not self._gnss_done and utc_us is not None:
            self._take_gnss(utc_us, now_us)
        passed_us = now_us - self._saved_us
        if passed_us >= SAVE_US or self.state.timestamp > self._saved + passed_us // 10 + LEAP:
            self._save(now_us)
        return self.state.floor > floor

    def close(self, now_us: int) -> None:
        """Save the stamps for good; nothing may be accepted after this."""
        if self.state.key is not None:
            self._save(now_us, clean=True)

    def met(self, endpoint: str) -> str:
        """What a station that has just been met on an endpoint must be told; empty when nothing."""
        return f"Endpoint {endpoint} takes orders from anybody: insecure = true" if endpoint in self._doors else ""

    def take_key(self, key: bytes) -> None:
        """A new key from a station whose right to it has been checked; kept in the file first."""
        if self._path is None:
            return
        path, witness = self._path, self.state.witness
        simulated = self._store.snapshot().world == WorldKind.SIMULATED

        def keep() -> bytes:
            try:
                write_key(path, key, replace=True)
            except KeyFileError as error:
                return str(error).encode()
            return b""

        problem = witness.made(bytes if simulated or witness.placeholder is not None else keep).decode()
        if problem:
            self._say(Severity.ERROR, f"New signing key not taken: {problem}")
            return
        self.state.key = key
        told = witness.made(lambda: fingerprint(key).encode()).decode()
        self._say(Severity.WARNING, f"New signing key{' for this simulation' * simulated}, fingerprint {told}")

    def _warn(self) -> None:
        for name in self._doors:
            log.warning("endpoint %s takes orders from anybody (insecure = true)", name)
            self._say(Severity.WARNING, self.met(name))

    def _take_gnss(self, utc_us: int, now_us: int) -> None:
        """GNSS can be spoofed: it moves the stamp forward only, once, and only so far."""
        self._gnss_done = True
        stamp, base = units_from_utc(utc_us), self._base or 0
        behind = (
            stamp - base - now_us // 10
        )  # of our own clock, whatever stations, or who replays them, have made of the stamp since
        if behind <= 0 or (behind > MAX_GNSS_STEP and not self._is_blank):
            return
        self._base = base + behind
        self.state.advance(utc_us)
        if behind > NEW_STREAM_BEHIND:
            self.state.floor = max(self.state.floor, stamp - NEW_STREAM_BEHIND)

    def _restore(self) -> None:
        stamps = self._store.snapshot().stamps
        streams = [[*map(int, name.split("/")), stamp] for name, stamp in stamps.items() if _is_stream(name)]
        clean = stamps.get(CLEAN) == 1
        self.state.restore({"timestamp": stamps.get(OWN, 0), "streams": streams}, margin_s=0.0 if clean else MARGIN_S)
        # Whatever was accepted before power was lost lies below the own stamp, since accepting moves it, and so do frames that
        # somebody recorded. Stations that use a MAVLink library take over our stamp with the first frame that they hear and get
        # through at once; one that goes by its own right clock waits MARGIN_S at the longest.
        self.state.floor = max(stamps.get(FLOOR, 0), 0 if clean else self.state.timestamp)

    def _save(self, now_us: int, *, clean: bool = False) -> None:
        state = self.state
        self._saved, self._saved_us = state.timestamp, now_us
        ops = [SaveStamp(OWN, state.timestamp), SaveStamp(FLOOR, state.floor), SaveStamp(CLEAN, int(clean))]
        ops += [SaveStamp("/".join(map(str, stream)), stamp) for stream, stamp in state.streams.items()]
        self._store.submit(Together(tuple(ops)))


def _is_stream(name: str) -> bool:
    parts = name.split("/")
    return len(parts) == 3 and all(part.isdigit() for part in parts)

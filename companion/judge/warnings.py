"""What a person should look at before sailing with a configuration that can be used: each a sentence with its key."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from mavlink_bridge.language.messages import Action

from .. import security
from ..core.nmea.wanted import WantedSentences
from ..io.links import LinkConfigError, parse_link_url
from ..io.links.url import LinkUrl
from ..settings import Settings, load_vessel
from ..settings.told import named
from .carriers import carrier_warnings, closed_doors
from .hulls import hull_warnings
from .idle import idle_notes
from .places import store_mistakes
from .thresholds import threshold_warnings

if TYPE_CHECKING:
    from ..gateway import GatewaySettings

USUAL_BAUD: Final = frozenset(
    {1200, 2400, 4800, 9600, 14400, 19200, 28800, 38400, 57600, 76800, 115200, 128000, 230400, 256000, 460800, 921600}
)
OLD_S: Final = 3.0
"""A sensor that is silent for so long is lost: the slowest that is sailed by tells three times in it."""
SIMULATOR: Final = ("127.0.0.1", 3000)
"""Where a simulator on this computer offers its sensors."""


_DEPTHS: Final = ("DPT", "DBT", "DBS", "DBK")
_MEANT: Final = "(insecure = true)"


def verdict(warnings: Sequence[str]) -> str:
    """What is said first of a file without mistakes. A door that the owner has opened with ``insecure = true`` is meant."""
    count = sum(1 for warning in warnings if not warning.endswith(_MEANT))
    return f"can be used; look at {count} warning{'s' * (count > 1)}" if count else "good"


def vessel_warnings(settings: Settings) -> list[str]:
    """What to look at of a vessel's settings and of this computer."""
    found = [text for key, url, baud in _vessel_links(settings) for text in _rate(key, url, baud)]
    found += [
        *_switches(settings),
        *_recordings(settings),
        *_late(settings),
        *_blind(settings),
        *_old_positions(settings),
    ]
    found += [f"endpoint {name} takes orders from anybody {_MEANT}" for name in security.open_doors(settings)]
    found += [f"{named(key, _names(settings))}: {told} {_MEANT}" for key, told, _ in security.open_devices(settings)]
    found += [named(text, _names(settings)) for text in (*carrier_warnings(settings), *threshold_warnings(settings))]
    found += [f"{settings.vessel}: {text}" for text in hull_warnings(load_vessel(settings.vessel))]
    found += _opens_nothing(settings)
    found += _place("store", settings.store, is_folder=False)
    if settings.record.enabled:
        found += _place("record.directory", settings.record.directory, is_folder=True)
        found += _room(settings)
    return found


def vessel_notes(settings: Settings) -> list[str]:
    """What is so now, and may be meant: devices that are not plugged in, a simulator's address."""
    found = [text for key, url, _ in _vessel_links(settings) for text in _device(key, url)]
    found += [*_simulator(settings), *_unused(settings), *_habits(settings)]
    return found + [named(text, _names(settings)) for text in idle_notes(settings)]


def _names(settings: Settings) -> dict[str, list[dict[str, str]]]:
    """The lists of links by which an item is named instead of numbered."""
    sensors, endpoints = ([item.name for item in settings.sensors], [item.name for item in settings.endpoints])
    return {
        table: [{"name": name} for name in names] for table, names in (("sensors", sensors), ("endpoints", endpoints))
    }


def gateway_warnings(settings: GatewaySettings) -> list[str]:
    """The same of a gateway's."""
    found = [text for key, url in _gateway_links(settings) for text in _rate(key, url, None)]
    found += [f"endpoint {name} takes orders from anybody {_MEANT}" for name in security.open_doors(settings)]
    found += closed_doors(_gateway_links(settings))
    return found + list(_place("store", settings.store, is_folder=False))


def gateway_notes(settings: GatewaySettings) -> list[str]:
    """Devices of a gateway that are not plugged in."""
    return [text for key, url in _gateway_links(settings) for text in _device(key, url)]


def _vessel_links(settings: Settings) -> list[tuple[str, str, int | None]]:
    links = [(f"sensors {item.name!r} url", item.url, item.baud) for item in settings.sensors]
    links.append(("actuators.url", settings.actuators.url, settings.actuators.baud))
    links += [(f"endpoints {item.name!r} url", item.url, None) for item in settings.endpoints]
    return [*links, ("radio.url", settings.radio.url, None)]


def _gateway_links(settings: GatewaySettings) -> list[tuple[str, str]]:
    return [("url", settings.url), *((f"endpoints {item.name!r} url", item.url) for item in settings.endpoints)]


def _opens_nothing(settings: Settings) -> Iterator[str]:
    """A door that is opened where there is none."""
    for item in settings.sensors:
        if item.insecure and _serial(item.url, item.baud) is not None:
            yield f"sensors {item.name!r} insecure = true: a serial line has one sender, and nothing to open; leave it out"


def _rate(key: str, url: str, baud: int | None) -> Iterator[str]:
    """A rate that few devices know."""
    parsed = _serial(url, baud)
    rate = "" if parsed is None else str(parsed.options.get("baud", ""))
    if rate.isdigit() and int(rate) not in USUAL_BAUD:
        nearest = min(USUAL_BAUD, key=lambda usual: abs(usual - int(rate)))
        yield f"{key} = {url!r}: {rate} baud is unusual; was {nearest} meant?"


def _serial(url: str, baud: int | None = None) -> LinkUrl | None:
    try:
        parsed = parse_link_url(url, {} if baud is None else {"baud": baud}) if url else None
    except LinkConfigError:
        return None
    return parsed if parsed is not None and parsed.scheme == "serial" else None


def _device(key: str, url: str) -> Iterator[str]:
    """A serial port that is not there now, or not ours to open."""
    parsed = _serial(url)
    if parsed is None or "RUN_DIR" in parsed.where or os.name == "nt":
        return
    path = Path(parsed.path())
    if not path.exists():
        yield f"{key} = {url!r}: not there now; the run starts without it and takes it when it is plugged in"
    elif not os.access(path, os.R_OK | os.W_OK):
        yield f"{key} = {url!r}: this user may not open it; add the user to the group dialout"


def _simulator(settings: Settings) -> Iterator[str]:
    for item in settings.sensors:
        try:
            parsed = parse_link_url(item.url)
            known = parsed.scheme == "tcp" and parsed.host_port() == SIMULATOR
        except LinkConfigError:
            continue
        if known:
            yield f"sensors {item.name!r} url = {item.url!r}: is where a simulator on this computer offers its own sensors"


def _switches(settings: Settings) -> Iterator[str]:
    if not settings.operator.gcs_required and settings.actuators.url:
        yield "operator.gcs_required = false: nothing happens when the ground station is lost"
    elif {settings.failsafe.gcs_action, settings.failsafe.gcs_then_action} <= {Action.WARN, Action.NONE}:
        yield "failsafe.gcs_action = 'warn': nothing happens when the ground station is lost, as gcs_then_action does no more"
    if not settings.operator.store_required:
        yield "operator.store_required = false: what is changed while the store cannot be written is lost with the power"
    if not settings.depth.enabled and settings.actuators.url:
        yield "depth.enabled = false: no depth guard; nothing stops the vessel before a shoal"
    if settings.depth.enabled and settings.depth.min_altitude_m == 0.0:
        yield "depth.min_altitude_m = 0: the guard stops the vessel when the keel touches; enabled = false says that none is wanted"
    if settings.depth.enabled and settings.depth.unknown_policy == "ignore" and not settings.depth.required:
        yield "depth.unknown_policy = 'ignore': she sails on, and says nothing, when the sounder is silent; 'warn', 'slow' or 'stop'"
    if not settings.fence.enabled:
        yield "fence.enabled = false: no fence is kept, whatever a plan brings"
    if "url" not in settings.actuators.model_fields_set:
        yield f'actuators.url: not said, so {settings.actuators.url} is opened; name the board\'s device, or "" for none'
    if settings.actuators.board.level == "0":
        yield 'actuators.board.level = "0": the board does not stop if this computer dies'
    if settings.estimate.accept_simulated:
        yield "estimate.accept_simulated = true: believes positions that a receiver marks as simulated; for the bench only"


def _old_positions(settings: Settings) -> Iterator[str]:
    """How far she sails by a picture that nothing renews."""
    estimate, cruise_mps = settings.estimate, settings.mission.cruise_speed_mps
    for key, old_s in (
        ("position_timeout_s", estimate.position_timeout_s),
        ("heading_timeout_s", estimate.heading_timeout_s),
    ):
        if old_s > OLD_S:
            yield f"estimate.{key} = {old_s:g}: she sails {old_s * cruise_mps:.0f} m before a silent sensor counts as lost"


def _recordings(settings: Settings) -> Iterator[str]:
    """A board that is driven by where the boat was at another time."""
    for item in settings.sensors:
        if item.url.strip().startswith("file:") and settings.actuators.url:
            yield (
                f"sensors {item.name!r} url = {item.url!r}: a recording says where the boat is, and {settings.actuators.url} moves; "
                'for the bench only: actuators.url = "" keeps her still'
            )


def _unused(settings: Settings) -> Iterator[str]:
    """Gains that stand in the file and steer nothing: they may be kept for another day."""
    steering = settings.steering
    for profile, other in (("seed", "model"), ("model", "seed")):
        if profile in steering.model_fields_set and steering.profile == other:
            yield f"steering.{profile}: is not used, profile is {other!r}; set profile = {profile!r}, or leave the table out"


def _late(settings: Settings) -> Iterator[str]:
    """A heading loop that is told less than the sensors."""
    told = settings.steering.model
    latest_s = max((item.nmea.heading_latency_s for item in settings.sensors), default=0.0)
    if "heading_late_s" in told.model_fields_set and told.heading_late_s < latest_s:
        yield (
            f"steering.model.heading_late_s = {told.heading_late_s:g}: a sensor's nmea.heading_latency_s is {latest_s:g}; "
            "leave it out, and the sensor's counts"
        )


def _blind(settings: Settings) -> Iterator[str]:
    """A guard without a sounder: no link lets a sentence with a depth in."""
    named = [WantedSentences(item.nmea.sentences, item.nmea.talkers) for item in settings.sensors]
    if settings.depth.enabled and not any(wanted.allows(f"SD{kind}") for wanted in named for kind in _DEPTHS):
        key = "required" if settings.depth.required else "enabled"
        yield (
            f"depth.{key} = true: no sensor's nmea.sentences let a depth in, and the guard sees nothing unless a station sends depths; "
            "add DPT or DBT"
        )


def _room(settings: Settings) -> Iterator[str]:
    """A disk that is smaller than what is to stay free on it."""
    folder = Path(settings.record.directory).absolute()
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        total_mb = shutil.disk_usage(folder).total // 10**6
    except OSError:
        return
    if settings.record.free_floor_mb >= total_mb:
        yield f"record.free_floor_mb = {settings.record.free_floor_mb}: the disk has {total_mb} MB in all, and nothing would be recorded"


def _habits(settings: Settings) -> Iterator[str]:
    if not settings.store:
        yield 'store = "": plans and parameters are lost at every stop'
        if settings.security.key_file:
            yield 'store = "" with security.key_file: what was recorded before is good again until GNSS or a right clock tells the time'
    if not settings.record.enabled:
        yield "record.enabled = false: nothing is left of a run to look at"


def _place(key: str, place: str, *, is_folder: bool) -> Iterator[str]:
    """A place that cannot be written now; the run starts, and says so again."""
    if not place or "RUN_DIR" in place:
        return
    path = Path(place)
    folder = path if is_folder else path.parent
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    problem = ""
    if not is_folder and path.is_dir():
        problem = "is a folder; name a file"
    elif not folder.is_dir():
        problem = f"{folder} is no folder"
    else:
        try:
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError as error:
            problem = f"cannot be written: {error.strerror or error}"
    if problem:
        yield f"{key} = {place!r}: {problem}; nothing is kept there until it can be"


def gateway_place_mistakes(settings: GatewaySettings, path: Path) -> list[str]:
    """Where a gateway's store cannot be: it is judged as a vessel's."""
    named = {
        "this very configuration": str(path),
        "key_file": settings.key_file,
        "security.key_file": settings.security.key_file,
        "vessel_config": settings.vessel_config,
        "profile": settings.profile if settings.profile.endswith(".toml") else "",
    }
    return store_mistakes(settings.store, named)

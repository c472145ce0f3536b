"""A configuration judged whole: by its schema, and by what only the addresses and files that it names can tell.

Every command that opens links reads its settings here, so that whatever is wrong is told in one go, each mistake with its
key, its value and the mend, before anything opens.
"""

from __future__ import annotations

import contextlib
import functools
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from . import security
from .core.guard.depth.config import DepthMapConfig
from .core.guard.depth.grid import DepthGrid
from .core.hull import VesselConfig
from .core.nmea import KINDS
from .core.nmea.wanted import unknown_names
from .core.steer import SteeringError, make_controller
from .io.depth_map import load_depth_map
from .io.keeping import keys
from .io.keeping.hold import HeldError, hold
from .io.links import LinkConfigError, Reach, check_link, kind_of, parse_link_url
from .judge import (
    collisions,
    endpoint_mistakes,
    file_mistakes,
    gain_mistakes,
    gateway_place_mistakes,
    hull_meaning,
    hull_mistakes,
    vessel_meaning,
)
from .radio import SIMULATION_KEY, load_radio, read_key
from .settings import ConfigError, Settings, load, load_vessel

if TYPE_CHECKING:
    from .gateway import GatewaySettings

AnySettings = TypeVar("AnySettings", bound=Settings)
_EVERY_INTERFACE: Final = ("", "0.0.0.0", "::")
_RUN_DIR: Final = "RUN_DIR"
_OFFERED: Final = ("reset", "step", "configure", "water_speed_mps")
"""What the program calls a steering law by."""


def vessel_settings(
    path: Path, overrides: Sequence[str], *, to_sail: bool = False, run_dir: Path | None = None
) -> Settings:
    """Read a vessel's configuration. Raises ConfigError with every mistake.

    ``to_sail``: the radio's key must be there by now. ``run_dir``: what RUN_DIR stands for, None = a directory that is yet to be made.
    """

    def found(settings: Settings) -> list[str]:
        missing = radio_key_mistakes(settings, must_be=to_sail, run_dir=run_dir)
        return vessel_mistakes(settings) + file_mistakes(settings, path) + missing

    return load(path, overrides, Settings, further=found)


def gateway_settings(path: Path, overrides: Sequence[str], *, to_serve: bool = False) -> GatewaySettings:
    """Read a gateway's configuration. ``to_serve``: its key must be there by now. Raises ConfigError with every mistake."""
    from .gateway import GatewaySettings

    def found(settings: GatewaySettings) -> list[str]:
        missing = _key_mistakes(settings.key_file, settings.url, must_be=to_serve, table="")
        return gateway_mistakes(settings) + gateway_place_mistakes(settings, path) + missing

    return load(path, overrides, GatewaySettings, further=found)


@contextlib.contextmanager
def own_store(config: Path, store: str) -> Iterator[None]:
    """Have a store for this process alone, none for an empty name. Raises ConfigError with who has it."""
    with contextlib.ExitStack() as stack:
        if store:
            try:
                stack.enter_context(hold(Path(store)))
            except HeldError as error:
                raise ConfigError(str(config), [f"store = {store!r}: {error}"]) from None
        yield


def vessel_mistakes(settings: Settings) -> list[str]:
    """What of a vessel's settings cannot be meant, though each value is of the right kind."""
    found = link_mistakes(settings) + security.mistakes(settings) + security.device_mistakes(settings)
    found += [mistake for number in range(len(settings.sensors)) for mistake in _sentence_mistakes(settings, number)]
    if settings.radio.url:
        found += mistakes_of(lambda: load_radio(settings.radio.profile)) or _beacon_mistakes(settings)
    found += page_key_mistakes(settings)
    found += mistakes_of(lambda: depth_map(settings.depth.map)) + vessel_meaning(settings)
    hull = mistakes_of(lambda: load_vessel(settings.vessel, further=hull_mistakes))
    if hull:
        return found + hull
    vessel = load_vessel(settings.vessel)
    found += hull_meaning(settings, vessel)
    return found + (steering_mistakes(settings, vessel) or gain_mistakes(settings, vessel))


def gateway_mistakes(settings: GatewaySettings) -> list[str]:
    """The same of a gateway's."""
    wanted = [("url", settings.url, None)]
    wanted += [(f"endpoints.{number}.url", item.url, None) for number, item in enumerate(settings.endpoints)]
    found = (
        [] if settings.url else ["url = '': is empty; give the shore modem's port, \"serial:/dev/ttyUSB0?baud=9600\""]
    )
    found += [*_wrong_links(wanted), *security.mistakes(settings), *endpoint_mistakes(settings.endpoints)]
    found += [mistake.removeprefix("radio.") for mistake in mistakes_of(lambda: load_radio(settings.profile))]
    if settings.vessel_config:
        of_vessel = mistakes_of(lambda: load(Path(settings.vessel_config), [], Settings))
        head = f"{settings.vessel_config}: "
        found += [f"vessel_config = {settings.vessel_config!r}: {each.removeprefix(head)}" for each in of_vessel]
    return found


def link_mistakes(settings: Settings) -> list[str]:
    """Every link of a vessel whose address cannot be meant, with its key."""
    wanted = [(f"sensors.{number}.url", item.url, item.baud) for number, item in enumerate(settings.sensors)]
    wanted.append(("actuators.url", settings.actuators.url, settings.actuators.baud))
    wanted += [(f"endpoints.{number}.url", item.url, None) for number, item in enumerate(settings.endpoints)]
    wanted.append(("radio.url", settings.radio.url, None))
    wanted.append(("plotter", settings.plotter, None))
    return _wrong_links(wanted)


def radio_key_mistakes(settings: Settings, *, must_be: bool = True, run_dir: Path | None = None) -> list[str]:
    """What is wrong with the key of a vessel's compact radio. ``run_dir``: what RUN_DIR in its address stands for."""
    radio = settings.radio
    if not radio.url or radio.protocol != "compact":
        return []
    url = radio.url if run_dir is None else radio.url.replace(_RUN_DIR, str(run_dir))
    return _key_mistakes(radio.key_file, url, must_be=must_be)


def _beacon_mistakes(settings: Settings) -> list[str]:
    """A ground that counts as lost between any two of its beacons."""
    beacon_s, timeout_s = load_radio(settings.radio.profile).link.beacon_s, settings.failsafe.radio_timeout_s
    if settings.radio.protocol != "compact" or timeout_s > beacon_s:
        return []
    told = (
        f"the gateway tells that it is there every {beacon_s:g} s only; more than two of them, {2.0 * beacon_s + 5.0:g}"
    )
    return [f"failsafe.radio_timeout_s = {timeout_s:g}: {told}"]


def page_key_mistakes(settings: Settings) -> list[str]:
    """What is wrong with the key of the page's orders."""
    if not settings.page.key_file:
        return []
    try:
        keys.read_key(Path(settings.page.key_file))
    except keys.KeyFileError as error:
        return [f"page.key_file = {settings.page.key_file!r}: {error}; or leave page.key_file out: the page only shows"]
    return []


def _key_mistakes(key_file: str, url: str, *, must_be: bool, table: str = "radio.") -> list[str]:
    """What is wrong with a radio's key. ``must_be`` False: one that is named may be made later."""
    if key_file and not must_be and not Path(key_file).exists():
        return []
    found = mistakes_of(lambda: read_key(key_file))
    if not found and not _is_simulated(url) and read_key(key_file) == SIMULATION_KEY:
        told = "the simulator's key, which everybody has; make one of your own: companion keys make FILE"
        found = [f"radio.key_file = {key_file!r}: {told}"]
    return [table + mistake.removeprefix("radio.") for mistake in found]


def _is_simulated(url: str) -> bool:
    """Whether a radio's link ends on this computer: in memory, or at a pty, as the simulator's modems do.

    A new run's directory holds no modem but one that a simulator puts there.
    """
    try:
        parsed = parse_link_url(url)
        path = parsed.path()
        return kind_of(parsed).reach is Reach.HERE or _RUN_DIR in path or os.path.realpath(path).startswith("/dev/pts/")
    except LinkConfigError:
        return True  # told by the check of links


def steering_mistakes(settings: Settings, vessel: VesselConfig) -> list[str]:
    """Why the steering law of a profile cannot be made for a hull."""
    profile = settings.steering.profile
    try:
        law = make_controller(profile, settings.steering, vessel)
    except SteeringError as error:
        told = str(error).removeprefix(f"steering.profile {profile!r}").lstrip(": ")
        return [f"steering.profile = {profile!r}: {told}"]
    except Exception as error:  # a law of one's own may raise anything
        return [f"steering.profile = {profile!r}: cannot be made: {type(error).__name__}: {error}"]
    missing = [name for name in _OFFERED if not callable(getattr(law, name, None))]
    return (
        [f"steering.profile = {profile!r}: has no {', '.join(missing)}, which every steering law needs"]
        if missing
        else []
    )


def depth_map(wanted: DepthMapConfig) -> DepthGrid | None:
    """The chart that the settings name, if any. Raises ConfigError when the file cannot be used."""
    if wanted.file is None:
        return None
    try:
        about = wanted.file.stat()
        return _chart(wanted.model_dump_json(), about.st_mtime_ns, about.st_size)
    except OSError as error:
        raise ConfigError("depth.map", [f"depth.map.file = {str(wanted.file)!r}: {error.strerror or error}"]) from None
    except ValueError as error:
        told = str(error).removeprefix(f"{wanted.file}: ")
        if isinstance(error.__cause__, UnicodeDecodeError):
            told = (
                "holds no text: give XYZ, CSV or DUNE ini, or a .depth; 'companion depth convert' makes them of charts"
            )
        raise ConfigError("depth.map", [f"depth.map.file = {str(wanted.file)!r}: {told}"]) from None


@functools.lru_cache(maxsize=1)
def _chart(wanted_json: str, changed_ns: int, size: int) -> DepthGrid:
    """A chart takes its time to read: what has been judged is what is then sailed by."""
    wanted = DepthMapConfig.model_validate_json(wanted_json)
    assert wanted.file is not None
    return load_depth_map(wanted.file, wanted.pitch_m, wanted.spread_m, wanted.order)


def _sentence_mistakes(settings: Settings, number: int) -> list[str]:
    """Sentences wanted of a sensor that nothing here understands."""
    text = settings.sensors[number].nmea.sentences
    strange = unknown_names(text)
    if not strange:
        return []
    told = f"no sentence {', '.join(strange)} here; known: {', '.join(sorted(KINDS))}"
    return [f"sensors.{number}.nmea.sentences = {text!r}: {told}"]


def mistakes_of(read: Callable[[], object]) -> list[str]:
    """What a part of the configuration says when it is read; a file of its own is named before its keys."""
    try:
        read()
    except ConfigError as error:
        head = f"{error.source}: " if error.source.endswith(".toml") else ""
        return [f"{head}{mistake}" for mistake in error.mistakes]
    return []


def _wrong_links(wanted: Sequence[tuple[str, str, int | None]]) -> list[str]:
    """What is wrong with links, each as (key, address, baud rate)."""
    found = []
    doors: list[tuple[str, tuple[str, str, int]]] = []
    for key, url, baud in wanted:
        if not url:
            continue
        try:
            check_link(url, **({} if baud is None else {"baud": baud}))
            door = _door(url)
        except LinkConfigError as error:
            found.append(f"{key} = {url!r}: {str(error).removeprefix(f'{url}: ')}")
            continue
        if door is not None:
            holder = next((name for name, other in doors if _same_door(door, other)), "")
            doors.append((key, door))
            if holder:
                found.append(f"{key} = {url!r}: {holder} listens on port {door[2]} already; choose another port")
    return found + collisions([(key, url) for key, url, _ in wanted])


def _door(url: str) -> tuple[str, str, int] | None:
    """Kind, host and port on which a link listens; None for one that does not."""
    parsed = parse_link_url(url)
    return (parsed.scheme, *parsed.host_port()) if kind_of(parsed).reach is Reach.ANYBODY else None


def _same_door(one: tuple[str, str, int], other: tuple[str, str, int]) -> bool:
    hosts = {one[1], other[1]}
    shared = len(hosts) == 1 or any(host in _EVERY_INTERFACE for host in hosts)
    return one[0] == other[0] and one[2] == other[2] != 0 and shared

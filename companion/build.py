"""Builds a vessel's process from its settings: links, ports, store, recorder, endpoints.

The same function builds the boat, the simulated boat and a replay; only the maker of links and the clock differ.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.witness import Witness
from mavlink_bridge.mavlink.endpoint import Endpoint
from mavlink_bridge.mavlink.persona import Budget, EndpointConfig, Identity

from .app import App
from .configuration import depth_map, steering_mistakes
from .core.board import Arduino
from .core.hull import VesselConfig
from .core.hull.geometry import depths_of
from .core.nmea import NmeaConfig, NmeaReader
from .facade import identity_of
from .io.keeping import AnyStore, MemoryStore
from .io.keeping.mark import WorldKind
from .io.links import Link, Reach, kind_of, open_link, parse_link_url
from .io.recording import Recording
from .io.recording.log_archive import AnyArchive, LogArchive
from .logs import Logs
from .ports import ArduinoPort, GroundPort, NmeaPort, PlotterPort
from .radio import radio_conversation
from .security import Keeper, mistakes
from .settings import ConfigError, Settings, load_vessel
from .settings.schema import EndpointSettings, SensorConfig

AnySettings = TypeVar("AnySettings", bound=Settings)


class LinkMaker(Protocol):
    """Makes the link that a name and a URL describe."""

    def __call__(self, name: str, url: str, **options: object) -> Link: ...


def build_app(
    settings: Settings,
    *,
    make_link: LinkMaker = open_link,
    store: AnyStore | None = None,
    recording: Recording | None = None,
    reproducible: bool = False,
    about: Mapping[str, Any] | None = None,
    vessel: VesselConfig | None = None,
    identity: Identity | None = None,
    archive: AnyArchive | None = None,
    board_seen: bool | None = None,
    witness: Witness | None = None,
    keeps_voyage: bool = True,
) -> App:
    """Build the app; with ``recording`` its links and store are recorded, ``about`` going into the header.

    ``archive``: where stations' log downloads come from; a recorded run has one of its own.
    ``keeps_voyage``: whether the store remembers a voyage under way; a recording of an earlier program knows of none.
    ``board_seen``: whether a person has seen the outputs of a level-0 board move; None: as the store remembers.
    ``witness``: through whom keys are used; a replay's has none, and key files are left alone.
    ``vessel`` and ``identity`` stand for the settings' vessel file and this computer's own; a replay gives the recorded ones.
    """
    if witness is None:
        witness = Witness() if recording is None else recording.witness()
    _refuse_unsafe(settings, keys=witness.placeholder is None)
    vessel = vessel or load_vessel(settings.vessel)
    _refuse_unsteerable(settings, vessel)
    identity = identity or identity_of(settings, chance="" if reproducible else None)
    kept = store or MemoryStore()
    if board_seen is None:
        board_seen = _board_seen(settings, kept)
    links = _open_links(settings, vessel, _Opener(make_link, recording), board_seen=board_seen)
    if recording is not None:
        kept, archive = _recorded(settings, recording, kept, archive)
        more = {"board_seen": board_seen, "keeps_voyage": keeps_voyage}
        recording.start({**(about or {}), **_header(settings, vessel, identity), **more})
    app = App(
        settings=settings, vessel=vessel, sensors=links.sensors, actuators=links.board, store=kept, identity=identity
    )
    app.recorder = app.audit.diary = recording
    app.facade.logs = None if archive is None else Logs(archive, app.controls.voice.say)
    if keeps_voyage:
        app.keep_voyage()
    _load_map(app)
    app.keeper = Keeper(settings, kept, app.controls.voice.say, identity.started_utc_us, witness)
    _connect(app, app.keeper, links, witness)
    return app


def _refuse_unsafe(settings: Settings, *, keys: bool) -> None:
    not_safe = mistakes(settings, keys=keys)
    if not_safe:
        raise ConfigError("security", not_safe)


def _refuse_unsteerable(settings: Settings, vessel: VesselConfig) -> None:
    no_law = steering_mistakes(settings, vessel)
    if no_law:
        raise ConfigError("steering", no_law)


def _board_seen(settings: Settings, kept: AnyStore) -> bool:
    """Whether a person has seen the outputs move; of a simulated board nobody needs to."""
    content = kept.snapshot()
    return content.world == WorldKind.SIMULATED or mute_board(settings.actuators.url) in content.values


@dataclasses.dataclass(frozen=True, slots=True)
class _Links:
    """Everything that the vessel reads and writes, in the order in which a recording numbers it."""

    sensors: list[NmeaPort]
    board: ArduinoPort | None
    grounds: list[tuple[EndpointSettings, Link]]
    radio: Link | None
    plotter: Link | None


def _open_links(settings: Settings, vessel: VesselConfig, opener: _Opener, *, board_seen: bool) -> _Links:
    plain = settings.radio.protocol == "mavlink"
    return _Links(
        sensors=[_sensor(settings, vessel, opener, item) for item in settings.sensors],
        board=_board(settings, vessel, opener, seen=board_seen) if settings.actuators.url else None,
        grounds=[(item, opener.open(item.name, item.url, mavlink=True)) for item in settings.endpoints],
        radio=opener.open("radio", settings.radio.url, mavlink=plain) if settings.radio.url else None,
        plotter=opener.open("plotter", settings.plotter) if settings.plotter else None,
    )


def _sensor(settings: Settings, vessel: VesselConfig, opener: _Opener, item: SensorConfig) -> NmeaPort:
    link = opener.open(item.name, item.url, baud=item.baud)
    return NmeaPort(link, NmeaReader(_nmea(settings, item), item.name, depths_of(vessel, item.name)))


def _board(settings: Settings, vessel: VesselConfig, opener: _Opener, *, seen: bool) -> ArduinoPort:
    board = settings.actuators
    link = opener.open("actuators", board.url, baud=board.baud)
    return ArduinoPort(link, Arduino(board.board, vessel.rudder.max_rad, seen=seen))


def _recorded(
    settings: Settings, recording: Recording, kept: AnyStore, archive: AnyArchive | None
) -> tuple[AnyStore, AnyArchive]:
    """The store and the log archive of a run that is recorded."""
    own = LogArchive(Path(settings.record.directory), recording.recorder.run_dir, recording.recorder.writer)
    return recording.store(kept), recording.archive(archive or own)


def _connect(app: App, keeper: Keeper, links: _Links, witness: Witness) -> None:
    """Give the app its ground stations' ports, the radio's last, and the plotter's."""
    app.grounds += [_ground(app, keeper, number, item, link) for number, (item, link) in enumerate(links.grounds)]
    if links.radio is not None:
        app.grounds.append(_radio(app, links.radio, witness))
    if links.plotter is not None:
        app.plotter = PlotterPort(links.plotter)


def mute_board(url: str) -> str:
    """Name of the store's note that a person has seen the outputs of the level-0 board at an address move."""
    return f"mute-board/{url}"


def _header(settings: Settings, vessel: VesselConfig, identity: Identity) -> dict[str, Any]:
    """What a replay builds the same app from."""
    return {
        "settings": settings.model_dump(mode="json"),
        "vessel": vessel.model_dump(mode="json"),
        "identity": dataclasses.asdict(identity),
        "witness": True,
    }


def _nmea(settings: Settings, item: SensorConfig) -> NmeaConfig:
    return item.nmea.model_copy(update={"relay": True}) if settings.plotter else item.nmea


class _Opener:
    """Opens links in the order of reading, each wrapped for the recording."""

    def __init__(self, make_link: LinkMaker, recording: Recording | None) -> None:
        self._make = make_link
        self._recording = recording

    def open(self, name: str, url: str, *, baud: int | None = None, mavlink: bool = False) -> Link:
        options: dict[str, object] = {} if baud is None else {"baud": baud}
        link = self._make(name, url, **options)
        return link if self._recording is None else self._recording.link(link, mavlink=mavlink)


def _ground(app: App, keeper: Keeper, number: int, item: EndpointSettings, link: Link) -> GroundPort:
    config = EndpointConfig(
        name=item.name,
        persona=item.persona,
        system_id=app.settings.system.system_id,
        link_class=item.link_class,
        profile=item.profile,
        budget=_budget(item.budget_bytes_per_s),
        max_rate_hz=float(app.settings.system.tick_hz),
    )
    shared = app.shared

    def converse(channel: int, peer: str) -> Endpoint:
        def met(system_id: int, persona: str) -> None:
            shared.met(system_id, persona)
            warning = keeper.met(item.name)
            if warning:
                app.controls.voice.say(Severity.WARNING, warning)
            for severity, text in app.storage.standing:
                talk.say(severity, text)

        talk = Endpoint(
            config,
            app.facade,
            composer=shared.composer,
            locks=shared.locks,
            signing=keeper.state,
            link_id=number,
            on_key=keeper.take_key,
            on_station=met,
        )
        return talk

    doorstep = app.strangers.doorstep(config, keeper.state, number, shared.composer)
    is_called = kind_of(parse_link_url(item.url)).reach is Reach.CALLED
    return GroundPort(link, "peer" if is_called else "endpoint", converse, doorstep)


def _budget(bytes_per_s: int | None) -> Budget | None:
    return None if bytes_per_s is None else Budget(float(bytes_per_s), max(300, bytes_per_s))


def _radio(app: App, link: Link, witness: Witness) -> GroundPort:
    """The LoRa port."""
    talk = radio_conversation(app.settings, app.facade, app.store, app.shared, witness)
    return GroundPort(link, "radio", talk)


def _load_map(app: App) -> None:
    """Give the guard its depth map. Raises ConfigError when the file cannot be used."""
    chart = depth_map(app.settings.depth.map)
    if chart is not None:
        app.vehicle.parts.guard.set_map(chart)


def in_run_dir(settings: AnySettings, run_dir: Path) -> AnySettings:
    """Return settings with ``RUN_DIR`` in every URL replaced."""
    text = str(run_dir)

    def place(url: str) -> str:
        return url.replace("RUN_DIR", text)

    return settings.model_copy(
        update={
            "sensors": tuple(item.model_copy(update={"url": place(item.url)}) for item in settings.sensors),
            "actuators": settings.actuators.model_copy(update={"url": place(settings.actuators.url)}),
            "endpoints": tuple(item.model_copy(update={"url": place(item.url)}) for item in settings.endpoints),
            "radio": settings.radio.model_copy(update={"url": place(settings.radio.url)}),
        }
    )

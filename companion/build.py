"""Builds a vessel's process from its settings: links, ports, store, recorder, endpoints.

The same function builds the boat, the simulated boat and a replay; only the maker of links and the clock differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from mavlink_bridge.endpoint import Endpoint
from mavlink_bridge.endpoint_config import Budget, EndpointConfig

from .app import App
from .core.arduino import Arduino
from .core.nmea import NmeaReader
from .core.vessel import VesselConfig
from .io.inputs import InputRecorder, RecordingLink, links_meta
from .io.link import Link
from .io.links import open_link
from .io.recorder import Recorder
from .io.store import AnyStore, MemoryStore
from .ports import ArduinoPort, Conversation, GroundPort, NmeaPort
from .settings import EndpointSettings, Settings, load_vessel


class LinkMaker(Protocol):
    """Makes the link that a name and a URL describe."""

    def __call__(self, name: str, url: str, **options: object) -> Link: ...


@dataclass(slots=True)
class Built:
    """A vessel ready to run. ``opened``: its links in the order of the recording."""

    app: App
    opened: list[Link]
    vessel: VesselConfig


def build_app(
    settings: Settings,
    *,
    make_link: LinkMaker = open_link,
    store: AnyStore | None = None,
    reproducible: bool = False,
    inputs: Callable[[list[Link]], InputRecorder] | None = None,
) -> Built:
    """Build the app. ``inputs`` makes the input recorder once the links are known (it needs their list)."""
    vessel = load_vessel(settings.vessel)
    plain = _open_all(settings, make_link)
    recorder = inputs(plain) if inputs is not None else None
    links = [RecordingLink(link, recorder, number) for number, link in enumerate(plain)] if recorder else plain
    by_name: Mapping[str, Link] = {link.name: link for link in links}
    sensors = [NmeaPort(by_name[item.name], NmeaReader(item.nmea)) for item in settings.sensors]
    board = settings.actuators
    actuators = ArduinoPort(by_name["actuators"], Arduino(board.board)) if board.url else None
    app = App(settings, vessel, sensors, actuators, store or MemoryStore(), reproducible=reproducible)
    app.inputs = recorder
    for item in settings.endpoints:
        app.grounds.append(_ground(app, item, by_name[item.name]))
    if settings.radio.url:
        app.grounds.append(_radio(app, settings, by_name["radio"]))
    return Built(app, links, vessel)


def _open_all(settings: Settings, make_link: LinkMaker) -> list[Link]:
    links = [make_link(item.name, item.url, **_baud(item.baud)) for item in settings.sensors]
    if settings.actuators.url:
        links.append(make_link("actuators", settings.actuators.url, **_baud(settings.actuators.baud)))
    links += [make_link(item.name, item.url) for item in settings.endpoints]
    if settings.radio.url:
        links.append(make_link("radio", settings.radio.url))
    return links


def _baud(baud: int | None) -> dict[str, object]:
    return {} if baud is None else {"baud": baud}


def _ground(app: App, item: EndpointSettings, link: Link) -> GroundPort:
    config = EndpointConfig(
        name=item.name,
        persona=item.persona,
        system_id=app.settings.system.system_id,
        link_class=item.link_class,
        profile=item.profile,
        budget=_budget(item.budget_bytes_per_s),
    )
    tap = app.tap(len(app.grounds))

    def converse(channel: int, peer: str) -> Conversation:
        return Endpoint(config, app.facade, tap=tap)

    return GroundPort(link, "endpoint", converse)


def _budget(bytes_per_s: int | None) -> Budget | None:
    return None if bytes_per_s is None else Budget(float(bytes_per_s), max(300, bytes_per_s))


def _radio(app: App, settings: Settings, link: Link) -> GroundPort:
    """The LoRa port. ``mavlink`` is an ordinary endpoint on a small byte budget."""
    config = EndpointConfig(name="radio", system_id=settings.system.system_id, profile="lora")
    tap = app.tap(len(app.grounds))

    def converse(channel: int, peer: str) -> Conversation:
        return Endpoint(config, app.facade, tap=tap)

    return GroundPort(link, "radio", converse)


def make_inputs(
    recorder: Recorder, store: Mapping[str, Any], about: Mapping[str, Any]
) -> Callable[[list[Link]], InputRecorder]:
    """Return the maker of an input recorder that writes through ``recorder``."""

    def make(links: list[Link]) -> InputRecorder:
        return InputRecorder(recorder.input_sink, {**about, "links": links_meta(links)}, store)

    return make


def in_run_dir(settings: Settings, run_dir: Path) -> Settings:
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

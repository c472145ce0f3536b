"""The plant on its carriers: who hands the simulated sensors', board's and radio's bytes to the vessel's computer.

The vessel's own link URLs say what to serve: ``tcp://`` is served by a listening socket, ``serial:`` by a pty, ``mem:`` by the
other end in this process. So one configuration describes both sides.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from companion.configuration import depth_map
from companion.core.hull import VesselConfig
from companion.io.links import Link, LinkConfigError, Received, open_link
from companion.io.links.radio_port import SIMULATED_SET
from companion.radio import load_radio

from ..plant import Truth
from ..plant.truth import SIM_UTC_START_US
from ..radio import RadioPair
from ..radio.air import RadioEnd
from ..radio.module import FACTORY_BLOCK, LINE, PARITY_NAMES, set_up
from ..traffic import Fleet
from .plant import Board, Plant
from .settings import SimSettings

AIS_LINK: Final = "ais"
"""Name of the sensor link of an AIS receiver of its own."""
_RADIO_KEPT: Final = 2_000
"""Packets that a simulation remembers, some half an hour of them: without an end they were 15 MB a day."""


def counterpart(url: str) -> str:
    """Return the URL that serves what ``url`` connects to. Raises LinkConfigError for one that no simulator can serve."""
    scheme, _, rest = url.partition(":")
    if scheme == "tcp":
        return f"tcp-listen:{rest}"
    if scheme == "serial":
        return f"pty:{rest.partition('?')[0]}"
    if scheme == "mem":
        return url
    if scheme == "udp-listen":
        return f"udp:{rest}"
    raise LinkConfigError(f"the simulator cannot serve {url}: use tcp://, serial:RUN_DIR/... or mem:")


def served(settings: SimSettings) -> list[tuple[str, str]]:
    """Name and URL of every link that serves a simulated device to a vessel with these settings. Raises LinkConfigError."""
    return [(f"world-{item.name}", counterpart(item.url)) for item in settings.sensors]


def _pin(url: str) -> Path | None:
    """The file that stands for a module's SET pin, beside its pseudo-terminal."""
    scheme, _, path = url.partition(":")
    return Path(f"{path.partition('?')[0]}{SIMULATED_SET}") if scheme == "pty" else None


def _line(url: str) -> bytes:
    """How a host's port is set, as a module's block says it; what the URL leaves open is as the factory's."""
    words = dict(word.partition("=")[::2] for word in url.partition("?")[2].split("&") if word)
    codes = {
        "baud": words.get("baud"),
        "parity": PARITY_NAMES.get(words.get("parity", "")),
        "stop_bits": words.get("stop"),
    }
    return set_up(FACTORY_BLOCK, " ".join(f"{name}={value}" for name, value in codes.items() if value))[LINE]


@dataclass(slots=True)
class _RadioHost:
    """A radio module's serial side on a link."""

    end: RadioEnd
    link: Link
    pin: Path | None = None
    """The module's SET is low while this file is there."""

    def shuttle(self, now_us: int) -> None:
        if self.pin is not None:
            self.end.module.set_low = self.pin.exists()
        for event in self.link.poll(now_us):
            if isinstance(event, Received):
                self.end.write(event.data)
        if self.end.module.for_host:
            data = self.end.read()
            if data:
                self.link.write(0, data)


class Surroundings:
    """Plant and radio with their links. ``make_link`` as in ``companion.build``."""

    def __init__(
        self,
        settings: SimSettings,
        vessel: VesselConfig,
        seed: int,
        *,
        shore_url: str | None,
        make_link: Callable[[str, str], Link] = open_link,
        board: Board | None = None,
    ) -> None:
        first = settings.sensors[0].name if settings.sensors else ""
        chart = depth_map(settings.depth.map) if settings.world.bottom.kind == "chart" else None
        self.plant = Plant(settings.world, vessel, settings.actuators.board, seed, board, sensor=first, chart=chart)
        world = settings.world
        self.fleet = Fleet(world.vessels, world.ais, self.plant.frame, seed)
        """Other vessels."""
        names = [item.name for item in settings.sensors]
        self._ais_at = names.index(AIS_LINK) if AIS_LINK in names else 0
        """The link that brings AIS; one of that name brings nothing else."""
        self._ais_alone = AIS_LINK in names
        profile = load_radio(settings.radio.profile)
        radio = settings.world.radio.with_profile(profile.phy, profile.module_header_bytes)
        self.radio = RadioPair(radio, random.Random(f"{seed}/radio"), _RADIO_KEPT)
        self._nmea: list[tuple[Link, set[int]]] = [(make_link(name, url), set()) for name, url in served(settings)]
        """Each with its open channels."""
        self._board = (
            make_link("world-actuators", counterpart(settings.actuators.url)) if settings.actuators.url else None
        )
        self._hosts: list[_RadioHost] = []
        if settings.radio.url:
            self.radio.vessel.module.attach(_line(settings.radio.url), radio.vessel_module)
            self.radio.shore.module.attach(FACTORY_BLOCK[LINE], radio.shore_module)
            url = counterpart(settings.radio.url)
            self._hosts.append(_RadioHost(self.radio.vessel, make_link("world-radio", url), _pin(url)))
            if shore_url:
                self._hosts.append(_RadioHost(self.radio.shore, make_link("world-shore", shore_url), _pin(shore_url)))

    @property
    def truth(self) -> Truth:
        return self.plant.truth

    @property
    def links(self) -> Sequence[Link]:
        own = () if self._board is None else (self._board,)
        return (*(link for link, _ in self._nmea), *own, *(host.link for host in self._hosts))

    def step(self, now_us: int) -> Truth:
        """Advance the world to ``now_us``: take actuator bytes, move, hand sensor bytes over."""
        self.carry_commands()
        sentences, status = self.plant.step(now_us)
        if status and self._board is not None:
            self._board.write(0, status)
        truth = self.plant.truth
        if self.fleet.targets:
            own = truth.north_m, truth.east_m, truth.vn_mps, truth.ve_mps
            self._publish(now_us, b"".join(sentences), self.fleet.step(now_us, SIM_UTC_START_US + now_us, own))
        else:
            self._publish(now_us, b"".join(sentences))
        self._carry_radio(now_us)
        return self.plant.truth

    def pump(self, now_us: int) -> None:
        """Carry actuator and radio bytes; may be called between steps."""
        self.carry_commands()
        self._carry_radio(now_us)

    def _carry_radio(self, now_us: int) -> None:
        self.radio.air.step(now_us)
        for host in self._hosts:
            host.shuttle(now_us)

    def carry_commands(self) -> None:
        """Hand to the actuator board what the vessel has written, at the time that the plant has come to."""
        if self._board is None:
            return
        now_us = self.plant.now_us
        for event in self._board.poll(now_us):
            if isinstance(event, Received):
                self.plant.board.receive(event.data, now_us)

    def close(self) -> None:
        for link in self.links:
            link.close()

    def _publish(self, now_us: int, data: bytes, ais: bytes = b"") -> None:
        """Sensors speak on every link; the AIS receiver on its own (named "ais"), or on the first where there is none."""
        sensors = data
        for number, (link, channels) in enumerate(self._nmea):
            data = sensors
            if number == self._ais_at:
                data = ais if self._ais_alone else sensors + ais
            for event in link.poll(now_us):
                if isinstance(event, Received):
                    continue
                (channels.discard if hasattr(event, "reason") else channels.add)(event.channel)
            if data:
                for channel in channels:
                    link.write(channel, data)

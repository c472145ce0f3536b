"""Configuration: one TOML file plus explicit ``--set key=value``, checked whole before anything opens.

The models of the parts are put together here; ``load`` reads, merges, validates and reports every mistake at once,
each with its key, its value and the mend. No environment variables, no merging from hidden places.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

import config as shipped

from ..core.board import ActuatorConfig
from ..core.config import Config
from ..core.hull import VesselConfig
from ..core.nmea import NmeaConfig
from ..core.vehicle import VehicleConfig
from .reading import (
    ConfigError as ConfigError,
    Model,
    explain as explain,
    override as override,
    read_model,
    unreadable as unreadable,
)


class SensorConfig(Config):
    """One NMEA link. The seed's spellings of a device are accepted."""

    name: str = "nmea"
    """Names the link in texts, logs and in the hull file's antennas and transducers."""
    url: str = ""
    """serial:/dev/..., tcp://host:port, udp://..., file:path; also the seed's '/dev/ttyS0'. A vessel's file must name it."""
    baud: int | None = None
    """For a bare device path."""
    insecure: bool = False
    """Needed to listen where other machines can send: whoever does is believed where the boat is."""
    nmea: NmeaConfig = NmeaConfig()


class ActuatorLinkConfig(Config):
    """The actuator board: its link, and its protocol and channels."""

    url: str = "serial:/dev/ttyACM0?baud=115200"
    """serial:/dev/..., tcp://host:port; empty = no actuators."""
    baud: int | None = None
    """For a bare device path."""
    board: ActuatorConfig = ActuatorConfig()


class EndpointSettings(Config):
    """One link to ground stations."""

    name: str
    """Names the link in texts and logs."""
    url: str
    """serial:/dev/..., udp://host:port, udp-listen://:port, tcp-listen://:port."""
    persona: Literal["ardurover", "generic"] = "ardurover"
    """How the vessel presents itself: as ArduPilot's Rover, which stations know, or as itself."""
    link_class: Literal["trusted", "signed", "telemetry"] = "trusted"
    """Who is believed here: everybody, signed frames only, or nobody (the link only tells)."""
    profile: Literal["lan", "lora", "high_latency"] = "lan"
    """What is sent by itself: all, what a slow link carries, or HIGH_LATENCY2 alone."""
    budget_bytes_per_s: int | None = Field(None, ge=10)
    """Cap of what goes out; None = the profile's own."""
    insecure: bool = False
    """Needed to serve other machines without signing; puts up a standing warning."""


class RadioSettings(Config):
    """The vessel's radio port (LoRa)."""

    url: str = ""
    """Empty: no radio."""
    protocol: Literal["mavlink", "json", "compact"] = "mavlink"
    """compact: authenticated and short; json: the seed's text; mavlink: for a ground station's own modem."""
    profile: str = "o-10"
    """Name of a file in config/radio, or a path."""
    key_file: str = ""
    """32-byte key of the compact link; made by 'companion keys'."""
    insecure: bool = False
    """Needed for the protocols without a key, mavlink and json: whoever transmits on the channel commands the boat."""


class RecordConfig(Config):
    """What a run leaves behind."""

    directory: str = "runs"
    """Where each run gets a folder of its own."""
    enabled: bool = True
    """Record at all."""
    max_mb: int = Field(512, ge=8)
    """Total size of one run's files; the oldest pieces go first."""
    free_floor_mb: int = Field(200, ge=0)
    """Logging stops while the disk has less room than this."""
    make_room: bool = True
    """At its start `run` deletes old runs (never the newest 3, nor the newest 3 voyages) until one more fits above `free_floor_mb`."""


class SecurityConfig(Config):
    """Signing of MAVLink."""

    key_file: str = ""
    """32-byte key of all links with link_class = "signed"; made by 'companion keys make'. Empty = no signing."""


class PageConfig(Config):
    """The page on the boat: `companion web`, a process of its own that is off unless somebody starts it."""

    key_file: str = ""
    """32-byte key of Hold and Disarm on the page, made by `companion keys make --page`; empty: the page only shows."""
    bind: str = "127.0.0.1"
    """The address that the page is served at; 0.0.0.0 = every machine that reaches this computer reads it."""
    port: int = Field(8080, ge=0, le=65535)
    """0 = a free one, which is told."""
    names: tuple[str, ...] = ()
    """Names besides addresses and local ones by which browsers may call the boat: a VPN's, a domain's. Others are refused."""


class Settings(VehicleConfig):
    """The whole configuration of a vessel."""

    vessel: str = "otter"
    """Name of a file in config/vessels, or a path."""
    sensors: tuple[SensorConfig, ...] = ()
    actuators: ActuatorLinkConfig = ActuatorLinkConfig()
    endpoints: tuple[EndpointSettings, ...] = ()
    radio: RadioSettings = RadioSettings()
    plotter: str = ""
    """Where good NMEA sentences are sent on for a plotter: udp://host:10110, tcp-listen://:10110; empty = nowhere."""
    store: str = "state/companion.db"
    """The SQLite file that keeps plans, parameters and counters; empty = memory only."""
    record: RecordConfig = RecordConfig()
    security: SecurityConfig = SecurityConfig()
    page: PageConfig = PageConfig()

    @model_validator(mode="after")
    def _the_latest_compass_is_known(self) -> Self:
        """The law leaves margins for the heading that is latest, and the estimator waits for it, where nothing else is said."""
        late_s = max((item.nmea.heading_latency_s for item in self.sensors), default=0.0)
        law, estimate = self.steering.model, self.estimate
        if late_s > 0.0 and "heading_late_s" not in law.model_fields_set:
            told = law.model_copy(update={"heading_late_s": late_s})
            object.__setattr__(self, "steering", self.steering.model_copy(update={"model": told}))
        if late_s > 0.0 and "heading_late_s" not in estimate.model_fields_set:
            object.__setattr__(self, "estimate", estimate.model_copy(update={"heading_late_s": late_s}))
        return self


def load(
    path: Path | None,
    overrides: Sequence[str] = (),
    model: type[Model] = Settings,  # type: ignore[assignment]
    *,
    further: Callable[[Model], list[str]] = lambda settings: [],
) -> Model:
    """Read a TOML file (None: defaults only), apply ``key=value`` overrides and validate: ``read_model``, of a vessel by default."""

    def other_kind(data: dict[str, Any]) -> str:
        if "hull" in data and "hull" not in model.model_fields:
            return 'is a vessel file, not a configuration; name it in yours (vessel = "my-boat.toml") and give that'
        if {"sensors", "endpoints"} & data.keys() and model is VesselConfig:
            return "is a configuration, not a vessel file; give the file that it names with vessel = ..."
        return ""

    return read_model(path, overrides, model, further=further, other_kind=other_kind)


def load_vessel(name: str, *, further: Callable[[VesselConfig], list[str]] = lambda vessel: []) -> VesselConfig:
    """Read a vessel file by its shipped name or by path; ``further`` finds what is wrong with it as a whole. Raises ConfigError."""
    folder, key = "vessels", "vessel"
    path = Path(name) if name.endswith(".toml") else shipped.path(folder, f"{name}.toml")
    if not path.is_file():
        known = ", ".join(sorted(item.stem for item in shipped.path(folder).glob("*.toml")))
        raise ConfigError(key, [f"{key} = {name!r}: no such file; shipped: {known}; or give a path to a .toml file"])
    return load(path, model=VesselConfig, further=further)

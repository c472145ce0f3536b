"""The scenario language: one TOML file that says what is sailed, in which water, what happens when, and what must come of it.

``read_scenario`` checks the whole file before anything moves and reports every mistake at once. Positions are metres
north and east of where the vessel starts, or latitude and longitude. ``docs/SCENARIOS.md`` is the manual.
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, model_validator

import config as shipped
from companion.core.config import Config
from companion.settings import ConfigError, explain, load, load_vessel
from companion.settings.device import no_device
from companion.settings.schema import unreadable
from mavlink_bridge.language.geodesy import LocalFrame
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import LoadPlan

from ..plant import WaterConfig
from ..radio import RadioConfig
from ..sensors import SensorFaults
from ..traffic import AisText, VesselText
from ..world import SimSettings
from .autostart import AutostartError, read_plan_file
from .expect import Expect
from .plan import LoiterPlace, Place, PlanText, compile_plan

LIBRARY = Path(__file__).resolve().parents[1] / "scenarios"
"""The scenarios that come along."""
MODES = {mode.value.lower(): mode for mode in Mode}


class About(Config):
    """What the scenario is."""

    title: str
    """One line."""
    shows: str = ""
    """What a reader may learn from it."""
    duration_s: float = Field(gt=0, le=10_800)
    seed: int = 1
    ground_station: bool = False
    """A ground station sends heartbeats from the start; without one the vessel is told not to expect any."""


class Rudders(Config):
    """Rudders that stand at an angle; one that is not named is free."""

    port_deg: float | None = Field(None, ge=-90, le=90)
    starboard_deg: float | None = Field(None, ge=-90, le=90)


class GotoAct(Place):
    """Go to a point and stay."""

    speed_mps: float | None = Field(None, gt=0, le=20)
    radius_m: float | None = Field(None, gt=0)


class SteerAct(Config):
    """Steer a heading at a speed: the seed's DesiredHeading and DesiredSpeed."""

    heading_deg: float = Field(ge=-360, le=360)
    speed_mps: float = Field(ge=0, le=20)


class OrbitAct(LoiterPlace):
    """Loiter at once."""

    speed_mps: float | None = Field(None, gt=0, le=20)


class SticksAct(Config):
    """Manual control held for a time."""

    surge: float = Field(0.0, ge=-1, le=1)
    yaw: float = Field(0.0, ge=-1, le=1)
    for_s: float = Field(gt=0)


class Act(Config):
    """Something that happens at ``t_s``: exactly one field besides."""

    t_s: float = Field(ge=0)
    refused: str | None = None
    """An order that must be refused, with this in the reason."""
    sensor: dict[str, bool | int | float] | None = None
    thruster_health: tuple[float, float] | None = None
    """Share of its thrust that each gives, port and starboard."""
    rudder_stuck: Rudders | None = None
    board: Literal["hang", "reset", "stop", "release"] | None = None
    supply_v: float | None = Field(None, ge=0, le=100)
    unplug: str | None = None
    plug: str | None = None
    radio: dict[str, bool | int | float] | None = None
    water: dict[str, float] | None = None
    ais: dict[str, bool | float] | None = None
    """How the AIS receiver hears from now on: keys of ``world.ais``."""
    station: Literal["silent", "back"] | None = None
    arm: Literal[True] | None = None
    disarm: Literal[True] | None = None
    abort: Literal[True] | None = None
    mode: str | None = None
    start: Literal[True] | None = None
    pause: Literal[True] | None = None
    resume: Literal[True] | None = None
    goto: GotoAct | None = None
    orbit: OrbitAct | None = None
    steer: SteerAct | None = None
    speed_mps: float | None = Field(None, gt=0, le=20)
    sticks: SticksAct | None = None
    param: dict[str, float] | None = None

    @property
    def name(self) -> str:
        """Which act it is."""
        return next(key for key in ACTS if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _one(self) -> Act:
        named = [key for key in ACTS if getattr(self, key) is not None]
        if len(named) != 1:
            raise ValueError(f"name exactly one act, not {', '.join(named) or 'none'}; there are {', '.join(ACTS)}")
        if self.refused is not None and named[0] not in ORDERS:
            raise ValueError(f"refused: nobody can refuse '{named[0]}'; it is for {', '.join(ORDERS)}")
        return self

    @model_validator(mode="after")
    def _names(self) -> Act:
        if self.mode is not None and self.mode.lower() not in MODES:
            raise ValueError(f"mode {self.mode!r}: choose one of {', '.join(MODES)}")
        for name, value in (self.sensor or {}).items():
            SensorFaults().set(name, value)
        _known(self.water, WaterConfig)
        _known(self.ais, AisText)
        _known({key: value for key, value in (self.radio or {}).items() if key != "jammed"}, RadioConfig)
        return self


ACTS = tuple(name for name in Act.model_fields if name not in ("t_s", "refused"))
ORDERS = (*ACTS[ACTS.index("arm") : ACTS.index("sticks")], "param")
"""Acts of an operator that the vessel answers."""


def _known(values: dict[str, Any] | None, model: type[Config]) -> None:
    """Check a part of another model's fields. Raises ValueError."""
    try:
        model.model_validate(values or {})
    except ValidationError as error:
        raise ValueError("; ".join(explain(item) for item in error.errors())) from None


class ScenarioText(Config):
    """A scenario file as written."""

    scenario: About
    settings: dict[str, Any] = Field(default_factory=dict)
    plan: PlanText = PlanText()
    vessel: tuple[VesselText, ...] = Field((), max_length=256)
    """Other vessels."""
    at: tuple[Act, ...] = ()
    expect: tuple[Expect, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _nothing_kept(self) -> ScenarioText:
        if self.settings.get("store"):
            raise ValueError(
                "settings.store: a scenario begins with an empty store of its own, in memory, so that it is the same each time; "
                "leave the key out, and give plans under [plan], parameters under [settings] or as an act"
            )
        return self

    @model_validator(mode="after")
    def _in_time(self) -> ScenarioText:
        late = [f"at t_s = {act.t_s:g}" for act in self.at if act.t_s >= self.scenario.duration_s]
        windows = [edge for item in self.expect for edge in (item.from_s, item.to_s) if edge is not None]
        late += [f"expect {edge:g} s" for edge in windows if edge > self.scenario.duration_s]
        if late:
            raise ValueError(f"after the end at {self.scenario.duration_s:g} s: {', '.join(late)}")
        return self


@dataclass(frozen=True, slots=True)
class Scenario:
    """A file that can be run: text, settings of vessel and world, and the plans as uploads."""

    name: str
    text: ScenarioText
    settings: SimSettings
    plans: tuple[LoadPlan, ...]


def library() -> list[Path]:
    """The shipped scenarios in the order of their names."""
    return sorted(LIBRARY.glob("*.toml"))


def find(name: str | Path) -> Path:
    """Return the file of a shipped name or a path. Raises ConfigError."""
    if str(name).endswith(".toml"):
        return Path(name)
    path = LIBRARY / f"{name}.toml"
    if not path.is_file():
        known = ", ".join(item.stem for item in library())
        raise ConfigError(str(name), [f"no such scenario; shipped: {known}; or give a path to a .toml file"])
    return path


def read_scenario(name: str | Path, *, base: Path | None = None, overrides: tuple[str, ...] = ()) -> Scenario:
    """Read a scenario by name or path, over a configuration file (``config/sim.toml``). Raises ConfigError, all mistakes."""
    path = find(name)
    data = _read(path)
    text: ScenarioText | None = None
    mistakes: list[str] = []
    try:
        text = ScenarioText.model_validate(data)
    except ValidationError as error:
        mistakes += [explain(item) for item in error.errors()]
    settings: SimSettings | None = None
    try:
        settings = _settings(data, base, overrides)
    except ConfigError as error:
        mistakes += [f"settings.{mistake}" for mistake in error.mistakes]
    plans: tuple[LoadPlan, ...] = ()
    if text is not None and settings is not None:
        mistakes += [
            f"at {act.t_s:g} s: no link {link!r}; there are {', '.join(links(settings))}"
            for act in text.at
            if (link := act.unplug or act.plug) is not None and link not in links(settings)
        ]
        try:
            plans = _plans(text.plan, settings, path.parent)
        except AutostartError as error:
            mistakes += [f"plan: {mistake}" for mistake in error.mistakes]
    if mistakes or text is None or settings is None:
        raise ConfigError(str(path), mistakes)
    return Scenario(path.stem, text, settings, plans)


def links(settings: SimSettings) -> tuple[str, ...]:
    """Names of the links that can be pulled."""
    names = [sensor.name for sensor in settings.sensors] + [endpoint.name for endpoint in settings.endpoints]
    return (*names, "actuators", *(("radio",) if settings.radio.url else ()))


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(no_device(path).read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(str(path), [unreadable(error)]) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), [f"not valid TOML: {error}"]) from None


def _settings(data: dict[str, Any], base: Path | None, overrides: tuple[str, ...]) -> SimSettings:
    written = data.get("settings", {})
    about = data.get("scenario", {})
    alone = not (isinstance(about, dict) and about.get("ground_station"))
    items = ["operator.gcs_required=false"] if alone else []
    items += _flat("", written) if isinstance(written, dict) else []
    if isinstance(data.get("vessel"), list):
        items.append(f"world.vessels={_toml(data['vessel'])}")
    settings = load(base or shipped.path("sim.toml"), [*items, *overrides], SimSettings)
    for name in {settings.vessel, settings.world.vessel or settings.vessel}:
        load_vessel(name)
    return settings


def _flat(prefix: str, table: dict[str, Any]) -> list[str]:
    """Tables to ``key=value`` items, so that they are merged and checked the way ``--set`` is."""
    items: list[str] = []
    for key, value in table.items():
        place = f"{prefix}{key}"
        items += _flat(f"{place}.", value) if isinstance(value, dict) else [f"{place}={_toml(value)}"]
    return items


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)


def _plans(text: PlanText, settings: SimSettings, folder: Path) -> tuple[LoadPlan, ...]:
    loads = compile_plan(text, LocalFrame(*settings.world.start_rad))
    if text.file is not None:
        loads += tuple(read_plan_file(folder / text.file))
    return loads

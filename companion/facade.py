"""The vessel as endpoints see it: parameters, plans in force, identity. The app owns it and changes it; endpoints read."""

from __future__ import annotations

import platform
import random
import secrets
import time
import uuid
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version

from mavlink_bridge.language.deeds import Deeds
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.requests import PlanItem, PlanKind, Reply, RequestBody, Result
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.mavlink.missions.service import UploadLocks
from mavlink_bridge.mavlink.persona import Identity, ParamInfo
from mavlink_bridge.mavlink.telemetry.streams import Composer
from mavlink_bridge.radio.session import NONCE_BYTES

from .core.vehicle.mission import Mission
from .logs import Logs
from .settings import Settings, params
from .settings.moved import parameter_told


class SettingsParams:
    """The parameter table over the settings in force."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.entries = tuple(sorted(params.present(settings), key=lambda entry: entry.param.name))
        self._index = {entry.param.name: number for number, entry in enumerate(self.entries)}
        if len(self._index) != len(self.entries):
            names = [entry.param.name for entry in self.entries]
            raise ValueError(f"parameter declared twice: {sorted({name for name in names if names.count(name) > 1})}")

    def __len__(self) -> int:
        return len(self.entries)

    def index(self, name: str) -> int | None:
        return self._index.get(name)

    def get(self, name: str) -> ParamInfo | None:
        number = self._index.get(name)
        return None if number is None else self.at(number)

    def at(self, index: int) -> ParamInfo | None:
        if not 0 <= index < len(self.entries):
            return None
        entry = self.entries[index]
        return ParamInfo(
            name=entry.param.name,
            value=params.read(self.settings, entry),
            minimum=entry.minimum,
            maximum=entry.maximum,
            unit=entry.param.unit,
            text=entry.text,
            live=entry.param.live,
            default=entry.default,
            increment=1.0 if entry.kind is not float else None,
            group=entry.path[0],
        )

    def key(self, name: str) -> str:
        """How the file calls a parameter; "" for one that is not there."""
        number = self._index.get(name)
        return "" if number is None else self.entries[number].key

    def change(self, name: str, value: float) -> Settings:
        """Return settings with one parameter changed. Raises ValueError with the reason."""
        number = self._index.get(name)
        if number is None:
            raise ValueError(parameter_told(name, value) or f"no parameter {name}")
        return params.write(self.settings, self.entries[number], value)


class Plans:
    """Items in force by kind, with their ids."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._items: dict[PlanKind, tuple[PlanItem, ...]] = dict.fromkeys(PlanKind, ())
        self._ids = dict.fromkeys(PlanKind, 0)
        self.ids = (0, 0, 0)
        """Ids of the plan, the fence and the rally points in force."""

    def items(self, kind: PlanKind) -> tuple[PlanItem, ...]:
        return self._items[kind]

    def plan_id(self, kind: PlanKind) -> int:
        return self._ids[kind]

    @property
    def home(self) -> tuple[float, float] | None:
        return self._mission.home

    def put(self, kind: PlanKind, items: tuple[PlanItem, ...]) -> None:
        self._items[kind] = items
        self._ids[kind] = plan_id(items) if items else 0
        self.ids = self._ids[PlanKind.MISSION], self._ids[PlanKind.FENCE], self._ids[PlanKind.RALLY]


class Shared:
    """What all endpoints of one vessel share: packed messages, upload locks, and who was met where."""

    def __init__(self, say: Callable[[Severity, str], None]) -> None:
        self.composer = Composer()
        self.locks = UploadLocks()
        self.say = say
        self._personas: dict[int, str] = {}

    def met(self, system_id: int, persona: str) -> None:
        """A ground station was heard first on an endpoint; warn when it uses both of the vessel's faces."""
        before = self._personas.setdefault(system_id, persona)
        if before not in (persona, "both"):
            self._personas[system_id] = "both"
            self.say(Severity.WARNING, f"Ground station {system_id} is on both personas: close one link")


class Facade:
    """The VehiclePort of ``mavlink_bridge.mavlink.persona.port``."""

    def __init__(self, settings: Settings, mission: Mission, identity: Identity) -> None:
        self.params = SettingsParams(settings)
        self.plans = Plans(mission)
        self.identity = identity
        self.deeds = Deeds()
        self.logs: Logs | None = None

    def noting(self, body: RequestBody, answer: Callable[[Reply], None]) -> Callable[[Reply], None]:
        """Return ``answer`` so that every link knows first what was done for this one."""

        def noted(reply: Reply) -> None:
            if reply.result is Result.ACCEPTED:
                self.deeds.note(body)
            answer(reply)

        return noted


def identity_of(settings: Settings, *, chance: str | None = None) -> Identity:
    """Return who this vessel is. ``chance``: of a simulation, that from which its start draws instead of from this computer's entropy,
    and nothing is told then that differs from computer to computer.
    """
    reproducible = chance is not None
    return Identity(
        uid=0x5553_5600_0000_0000 | settings.system.system_id if reproducible else uuid.getnode(),
        version=software_version(),
        os_version=(0, 0, 0) if reproducible else _os_version(),
        name=settings.system.name,
        started_utc_us=0 if reproducible else time.time_ns() // 1000,
        start_nonce=_start_nonce(settings, chance),
    )


def _start_nonce(settings: Settings, chance: str | None) -> str:
    if chance is not None:
        return random.Random(f"start/{settings.system.system_id}/{chance}").randbytes(NONCE_BYTES).hex()
    return secrets.token_bytes(NONCE_BYTES).hex()


def software_version() -> tuple[int, int, int]:
    """Return this software's version."""
    try:
        parts = version("usv-companion").split(".")
    except PackageNotFoundError:
        return 0, 0, 0
    numbers = [int(part) if part.isdigit() else 0 for part in (*parts, "0", "0")[:3]]
    return numbers[0], numbers[1], numbers[2]


def made_by() -> dict[str, str]:
    """Return what every run says of the program that made it."""
    return {"version": ".".join(map(str, software_version())), "python": platform.python_implementation()}


def _os_version() -> tuple[int, int, int]:
    numbers = [int(part) for part in platform.release().split("-")[0].split(".") if part.isdigit()]
    first, second, third = [*numbers, 0, 0, 0][:3]
    return first & 0xFF, second & 0xFF, third & 0xFF

"""The flags that the failsafe judges: one picture of what is well and what is not, in groups, each made by whoever knows it.

Each flag has one name, in its group, in the table of conditions and for people; ``changed`` finds its group.
"""

from __future__ import annotations

from dataclasses import field, fields, replace
from operator import attrgetter
from typing import Any, Final

from mavlink_bridge.language.value import value

from ..estimate.flags import PlaceFlags
from ..traffic.flags import TrafficFlags
from .board_watch import BoardFlags
from .depth.guard import DepthFlags
from .failsafe_orders import Order
from .fence import FenceFlags
from .monitors import MonitorFlags
from .propulsion import ThrustFlags

SILENT_S: Final = 2.5
"""As long as it takes to call a ground station silent."""


@value
class HelmFlags:
    """What the vessel is doing. Nothing of it is an alarm."""

    armed: bool = False
    autonomous: bool = False
    """The mode in force steers by position or heading (everything but Manual)."""
    manual: bool = False
    """Manual mode with sticks that are heard, or with somebody who may just be reaching for them."""
    manual_idle: bool = False
    """Manual mode in which no stick ever moved."""
    manual_age_s: float | None = None
    """Since the last stick message; None outside Manual."""
    guided_age_s: float | None = None
    """Since the last streamed set-point; None when nothing is streamed."""
    return_ordered: bool = False
    """The mode in force is a return that an operator ordered."""
    return_shut_off: bool = False
    """The straight way back leads across the fence. Asked only of a vessel that the fence has stopped."""
    resume: str = ""
    """The mode that a failsafe broke off, by the name that stations show, and what to change first; "" = none."""
    awaits_arming: bool = False
    """The depth lock has stopped the vessel, and nothing but a re-arm goes on."""


@value
class GroundFlags:
    """What operators do, and when they were last heard. Nothing of it is an alarm. Ages in s; None = never heard or not in use."""

    operator_order: Order | None = None
    """Event: an operator chose a mode, started or resumed a plan, or gave a guided order."""
    operator_arm: bool = False
    """Event: an operator armed."""
    gcs_required: bool = False
    gcs_age_s: float | None = None
    """Since the owner's last heartbeat on an ordinary link."""
    radio_age_s: float | None = None
    """Since the gateway's last authenticated beacon or other sign of the ground over the radio."""


@value
class StopFlags:
    """Operators' stops beyond a mode."""

    terminate: bool = False
    aborted: bool = False
    """Event: an operator's forced disarm over a link."""


@value
class PlanFlags:
    """Of the path that is sailed."""

    plan_invalid: bool = False


@value
class ProcessFlags:
    """Of the program around the vessel, as the app knows it."""

    storage_fault: bool = False
    task_failing: bool = False
    """A supervised part failed five times in 60 s."""


@value
class Flags:
    """What is known at this tick. Levels unless called events."""

    helm: HelmFlags = field(default_factory=HelmFlags)
    ground: GroundFlags = field(default_factory=GroundFlags)
    stop: StopFlags = field(default_factory=StopFlags)
    process: ProcessFlags = field(default_factory=ProcessFlags)
    board: BoardFlags = field(default_factory=BoardFlags)
    place: PlaceFlags = field(default_factory=PlaceFlags)
    depth: DepthFlags = field(default_factory=DepthFlags)
    fence: FenceFlags = field(default_factory=FenceFlags)
    plan: PlanFlags = field(default_factory=PlanFlags)
    monitors: MonitorFlags = field(default_factory=MonitorFlags)
    thrust: ThrustFlags = field(default_factory=ThrustFlags)
    traffic: TrafficFlags = field(default_factory=TrafficFlags)

    def any_alarm(self) -> bool:
        """Whether anything is wrong that a flag says; ages are not looked at."""
        return True in _ALARMS(self)


_CALM: Final = Flags()
_GROUPS: Final[dict[str, Any]] = {group.name: getattr(_CALM, group.name) for group in fields(Flags)}
HOME: Final = {item.name: name for name, group in _GROUPS.items() for item in fields(group)}
"""Every flag's group, by the flag's name."""
_CONTEXT: Final = ("helm", "ground")
ALARMS: Final = tuple(
    name for name, home in HOME.items() if home not in _CONTEXT and isinstance(getattr(_GROUPS[home], name), bool)
)
"""Names of the flags that are up only when something is wrong; a figure beside one is none."""
_ALARMS: Final = attrgetter(*(f"{HOME[name]}.{name}" for name in ALARMS))


def changed(flags: Flags, **named: Any) -> Flags:
    """Return the flags with some of them, by their own names, set to something else. ``KeyError``: no such flag."""
    groups: dict[str, dict[str, Any]] = {}
    for name, content in named.items():
        groups.setdefault(HOME[name], {})[name] = content
    return replace(flags, **{home: replace(getattr(flags, home), **content) for home, content in groups.items()})


def flags_of(**named: Any) -> Flags:
    """Return flags of which only the named ones are not as by default. ``KeyError``: no such flag."""
    return changed(_CALM, **named)


def now(flags: Flags, name: str) -> Any:
    """Return the flag of this name. ``KeyError``: no such flag."""
    return getattr(getattr(flags, HOME[name]), name)


def gcs_age(flags: Flags) -> float | None:
    """How long an armed vessel has heard no ground station that it needs, s; None = it is not asked."""
    return flags.ground.gcs_age_s if flags.helm.armed and flags.ground.gcs_required else None


def radio_age(flags: Flags) -> float | None:
    """The same of one over the radio."""
    return flags.ground.radio_age_s if flags.helm.armed and flags.ground.gcs_required else None


def gcs_silent(flags: Flags) -> bool:
    """Whether the ground station is silent though that is not judged: the vessel is not armed."""
    return not flags.helm.armed and (flags.ground.gcs_age_s or 0.0) > SILENT_S


def radio_silent(flags: Flags) -> bool:
    """The same of one over the radio."""
    return not flags.helm.armed and (flags.ground.radio_age_s or 0.0) > SILENT_S


def autonomous(flags: Flags) -> bool:
    """Whether an armed vessel steers itself."""
    return flags.helm.armed and flags.helm.autonomous

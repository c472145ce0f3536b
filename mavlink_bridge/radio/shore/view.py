"""The vessel as last heard over the radio: a ``Snapshot`` for the shore's endpoints, and cached plans and parameters.

Nothing is extrapolated: values keep the time of the state that brought them, and what the radio does not tell is
unknown.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...language.messages import Action, ActuatorOutput, ActuatorStatus, EstimatedState, GpsFix, LogText, SupplyVoltage
from ...language.requests import PlanItem, PlanKind
from ...language.snapshot import Health, Progress, Snapshot
from ...language.traffic import NO_TRAFFIC, TrafficPicture
from ...language.units import e7_to_rad
from ...mavlink.missions.plan_rules import plan_id
from ...mavlink.persona import ParamInfo, ParamTable
from ..codec.info import changed_params
from ..codec.request import name_codes
from ..codec.state_fields import RadioState, with_flags
from ..codec.threat import picture_of


class CachedParams:
    """The vessel's parameters: a table of the same software with the values that the vessel told."""

    def __init__(self, table: ParamTable) -> None:
        self._table = table
        self._codes = name_codes(info.name for index in range(len(table)) if (info := table.at(index)) is not None)
        self._values: dict[str, float] = {}
        self._foreign: dict[int, float] = {}
        """What the vessel told of parameters that this table does not have: of another hull, or of another version."""

    def __len__(self) -> int:
        return len(self._table)

    def index(self, name: str) -> int | None:
        return self._table.index(name)

    def get(self, name: str) -> ParamInfo | None:
        info = self._table.get(name)
        return None if info is None else self._with_value(info)

    def at(self, index: int) -> ParamInfo | None:
        info = self._table.at(index)
        return None if info is None else self._with_value(info)

    def _with_value(self, info: ParamInfo) -> ParamInfo:
        return replace(info, value=self._values[info.name]) if info.name in self._values else info

    @property
    def known(self) -> dict[str, float]:
        """What the vessel told or accepted."""
        return dict(self._values)

    @property
    def changed(self) -> dict[int, float]:
        """What differs from the defaults, by name code: as the vessel tells it."""
        return changed_params(self) | self._foreign

    def restore(self, values: Mapping[str, float]) -> None:
        """Take over ``known`` of an earlier run; names that this software does not have are left out."""
        self._values = {name: value for name, value in values.items() if self._table.get(name) is not None}

    def put(self, name: str, value: float) -> None:
        """Note a value that the vessel has accepted, as a REAL32."""
        self._values[name] = struct.unpack("<f", struct.pack("<f", value))[0]

    def put_changed(self, values: Mapping[int, float]) -> list[str]:
        """Take the vessel's list of what differs from the defaults, by name code; return the names that changed."""
        infos = [info for index in range(len(self)) if (info := self.at(index)) is not None]
        before = {info.name: info.value for info in infos}
        self._values = {info.name: info.default for info in infos if info.default is not None}
        self._foreign = {code: value for code, value in values.items() if code not in self._codes}
        for code, value in values.items():
            if code in self._codes:
                self._values[self._codes[code]] = value
        return [name for name, value in before.items() if self._values.get(name, value) != value]


class CachedPlans:
    """The plans that the vessel has, as far as the shore knows them."""

    def __init__(self) -> None:
        self._items: dict[PlanKind, tuple[PlanItem, ...]] = dict.fromkeys(PlanKind, ())
        self._ids = dict.fromkeys(PlanKind, 0)
        self.home_e7: tuple[int, int] | None = None

    def items(self, kind: PlanKind) -> tuple[PlanItem, ...]:
        return self._items[kind]

    def plan_id(self, kind: PlanKind) -> int:
        return self._ids[kind]

    @property
    def home(self) -> tuple[float, float] | None:
        if self.home_e7 is None:
            return None
        return e7_to_rad(self.home_e7[0]), e7_to_rad(self.home_e7[1])

    def put(self, kind: PlanKind, items: Sequence[PlanItem]) -> None:
        self._items[kind] = tuple(items)
        self._ids[kind] = plan_id(items) if items else 0


def snapshot_of(
    state: RadioState,
    heard_us: int,
    tick: int,
    neutral: ActuatorOutput,
    plans: CachedPlans,
    *,
    reached: tuple[int, ...] = (),
    texts: tuple[LogText, ...] = (),
) -> Snapshot:
    """Build the picture. ``neutral`` stands for the actuators, of which the radio tells nothing."""
    home = plans.home
    return Snapshot(
        t_us=heard_us,
        tick=tick,
        state=_estimated(state, heard_us),
        mode=state.mode,
        armed=state.armed,
        output=neutral,
        progress=_progress(state, plans, reached),
        fix=_fix(state, heard_us),
        guard=state.guard,
        action=state.action,
        terminated=state.action is Action.TERMINATE,
        health=_health(state),
        supply=None if state.battery is None else SupplyVoltage(heard_us, None, remaining=state.battery),
        actuator=ActuatorStatus(heard_us),
        home_lat_rad=home[0] if home else None,
        home_lon_rad=home[1] if home else None,
        texts=texts,
        traffic=_others(state, heard_us),
    )


def _estimated(state: RadioState, heard_us: int) -> EstimatedState:
    return EstimatedState(
        t_us=heard_us,
        lat_rad=state.lat_rad,
        lon_rad=state.lon_rad,
        psi_rad=state.psi_rad,
        phi_rad=state.phi_rad,
        theta_rad=state.theta_rad,
        sog_mps=state.sog_mps,
        alt_m=state.alt_m,
        fix_type=state.fix,
    )


def _progress(state: RadioState, plans: CachedPlans, reached: tuple[int, ...]) -> Progress:
    total = len(plans.items(PlanKind.MISSION))
    return Progress(
        state=state.plan_state,
        seq=_whole_seq(state.seq, total),
        total=total,
        mission_id=plans.plan_id(PlanKind.MISSION),
        fence_id=plans.plan_id(PlanKind.FENCE),
        rally_id=plans.plan_id(PlanKind.RALLY),
        reached=reached,
    )


def _fix(state: RadioState, heard_us: int) -> GpsFix:
    return GpsFix(
        heard_us,
        state.fix,
        lat_rad=state.lat_rad,
        lon_rad=state.lon_rad,
        sog_mps=state.sog_mps,
        satellites=state.satellites,
    )


def _health(state: RadioState) -> Health:
    return Health(
        gps=state.gps_ok,
        heading=state.heading_ok,
        # a tilt that is not known may never have been measured: no fault is claimed of what may not be there, as with the depth
        attitude=None if state.phi_rad is None and state.theta_rad is None else True,
        depth=None if state.alt_m is None else True,
        actuators=state.actuators_ok,
        battery=None if state.battery is None else True,
        prearm_ok=state.prearm_ok,
    )


def _others(state: RadioState, heard_us: int) -> TrafficPicture:
    if state.threat is None or state.lat_rad is None or state.lon_rad is None:
        return NO_TRAFFIC
    return picture_of(state.threat, state.lat_rad, state.lon_rad, heard_us)


def with_health(state: RadioState, newest: RadioState, *, flags: bool = True) -> RadioState:
    """One state with the battery, fix and attitude of another, and with its ``flags`` of health."""
    state = replace(
        state,
        phi_rad=newest.phi_rad,
        theta_rad=newest.theta_rad,
        battery=newest.battery,
        fix=newest.fix,
        satellites=newest.satellites,
    )
    return with_flags(state, newest) if flags else state


def _whole_seq(low: int, total: int) -> int:
    """The item number of which the radio tells the low seven bits: the only one in the plan, or the lowest."""
    return low if low < total or total == 0 else min(low, max(total - 1, 0))

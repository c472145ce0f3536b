"""The vessel as ``companion plan`` reaches it: MAVSDK's raw missions, with ArduPilot's home item added and taken off.

MAVSDK is imported only here and only when a command needs it. The vessel's own texts are shown as they come, because
they say why something was refused.
"""

from __future__ import annotations

import json
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.mavlink.missions.wire import with_home, without_home
from mavlink_bridge.mavlink.telemetry.numbering import vessels_text
from mavlink_bridge.mavlink.wire.cmd import Cmd
from mavlink_bridge.plans import PlanFile

from ...core.vehicle.insist import FORCE
from ...core.vehicle.plan_reach import FAR_OK, plan_number
from .. import install_line
from .find import PROBE_S
from .plan_watch import MISSION_CURRENT, PlanWatch
from .raw import place_rad, plan_item, raw_items, show_bar

INSTALL: Final = f"this needs MAVSDK: {install_line('ground')}"
_ARDUPILOT: Final = 2
_TRANSFER_S: Final = 900.0
_ARM_S: Final = 6.0
_REASON_S: Final = 1.5
_HEARTBEAT_S: Final = 3.0
"""Heartbeats come once a second; two may be lost."""
_LOOK_S: Final = 0.5
_AGAIN_S: Final = 0.5
"""Before a place that could not be opened is left for the next."""
_WHY: Final = {
    "bind error": "the port is taken: another program, a ground station for one, listens there",
    "socket connection error": "nothing listens there",
    "connection error": "nothing listens there",
}
_MEND: Final = (
    "name the boat's file with --config, its computer with --host, or the connection with --url; is the vessel running?"
)


class LinkError(RuntimeError):
    """The vessel was not found, or refused; the text says which and what."""


def with_vessel(urls: Sequence[str], wait_s: float, action: Callable[[Vessel], None]) -> int:
    """Find the vessel at one of ``urls``, run ``action`` on it, and return the exit status: 0, 1 failed, 2 wrong usage or no MAVSDK."""
    try:
        import mavsdk  # noqa: F401
    except ImportError:
        print(INSTALL, file=sys.stderr)
        return 2
    try:
        vessel = find(urls, wait_s)
        try:
            action(vessel)
        except LinkError:
            vessel.hear_reason()
            raise
    except LinkError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def find(urls: Sequence[str], wait_s: float, opened: Callable[[str], VesselSearch] | None = None) -> Vessel:
    """The vessel at the first place where one is heard; each is listened at in turn until ``wait_s`` is over. Raises LinkError.

    One after the other and not all at once: a station on both of the vessel's faces is told to close one.
    """
    opened = opened or VesselSearch
    until_s = time.monotonic() + wait_s
    tried: dict[str, str] = {}
    kept: dict[str, VesselSearch] = {}
    first = True
    while first or time.monotonic() < until_s:
        for url in urls:
            if first:
                print(f"looking for the vessel at {url}", file=sys.stderr, flush=True)
            left_s = max(until_s - time.monotonic(), 0.1)
            try:
                place = kept.get(url) or opened(url)
                kept[url] = place
                vessel = place.vessel(left_s if len(urls) == 1 else min(PROBE_S, left_s))
            except LinkError as error:
                tried[url] = str(error)
                time.sleep(min(_AGAIN_S, left_s))
                continue
            if vessel is not None:
                print(f"found at {url}", file=sys.stderr, flush=True)
                return vessel
            tried[url] = "open, but no vessel is heard"
        first = False
    told = "".join(f"\n  {url}: {why}" for url, why in tried.items())
    raise LinkError(f"no vessel found in {wait_s:g} s; tried:{told}\n{_MEND}")


def _knock(url: str) -> None:
    """MAVSDK does not tell whether a TCP server is there. Raises LinkError when none is."""
    scheme, _, where = url.partition("://")
    host, _, port = where.rpartition(":")
    if scheme == "tcpout" and port.isdecimal():
        try:
            socket.create_connection((host, int(port)), timeout=PROBE_S).close()
        except OSError as error:
            raise LinkError(f"nothing answers there: {error.strerror or error}") from None


class VesselSearch:
    """A connection where a vessel may be heard. Raises LinkError when it cannot be opened."""

    def __init__(self, url: str) -> None:
        from mavsdk import ComponentType, Configuration, Mavsdk
        from mavsdk.logging import log_subscribe

        log_subscribe(lambda *_: True)
        _knock(url)
        self._sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        result = self._sdk.add_any_connection(url)
        if int(result) != 0:
            why = result.name.lower().replace("_", " ")
            raise LinkError(_WHY.get(why, why))

    def vessel(self, wait_s: float) -> Vessel | None:
        """The vessel, if one is heard in so many seconds."""
        system = self._sdk.first_autopilot(wait_s)
        return None if system is None else Vessel(self._sdk, system)


class Vessel:
    """A connected vessel."""

    def __init__(self, sdk: Any, system: Any) -> None:
        from mavsdk.plugins.mission_raw import MissionRaw
        from mavsdk.plugins.telemetry import Telemetry

        self._sdk = sdk
        self._system = system
        self._mission = MissionRaw(system)
        self._telemetry = Telemetry(system)
        self._said: set[str] = set()
        self._refusals: list[str] | None = None
        """Why it does not arm yet, while it is asked to: what patience overcomes is not shown."""
        self.heard: list[str] = []
        """All texts of the vessel, as they came."""
        self.shows_again = False
        """A text that was shown before is shown again."""
        self._armed: bool | None = None
        self._telemetry.subscribe_status_text(lambda text, _: self._say(text.text))
        self._telemetry.subscribe_armed(self._note_armed)

    def _say(self, text: str) -> None:
        """Show a text of the vessel, each once; items count as in the files that this command line reads, without home."""
        text = vessels_text(text) if self.home_item else text
        self.heard.append(text)
        if self._refusals is not None and text.endswith(FORCE):
            self._refusals.append(text)
        else:
            self._show(text)

    def _show(self, text: str) -> None:
        if self.shows_again or text not in self._said:
            self._said.add(text)
            print(f"vessel: {text}", file=sys.stderr, flush=True)

    def _note_armed(self, armed: bool, _: Any) -> None:
        self._armed = armed

    def hear_reason(self) -> None:
        """Wait a moment for the text that says why something was refused: it comes after the refusal."""
        heard, until_s = len(self._said), time.monotonic() + _REASON_S
        while len(self._said) == heard and time.monotonic() < until_s:
            time.sleep(0.05)

    @property
    def home_item(self) -> bool:
        """True when this vessel counts a home item as 0, as ArduPilot does."""
        return int(self._system.autopilot_type()) == _ARDUPILOT

    def upload(self, plan: PlanFile) -> None:
        """Send what the plan has; kinds that it has not are left alone. Raises LinkError."""
        if plan.mission:
            items = with_home(plan.mission, plan.home_rad) if self.home_item else plan.mission
            self._upload_mission(raw_items(items, PlanKind.MISSION))
            print(f"mission: {len(plan.mission)} items uploaded")
        if plan.fence:
            self._call("fence upload", lambda: self._mission.upload_geofence(raw_items(plan.fence, PlanKind.FENCE)))
            print(f"fence: {len(plan.fence)} items uploaded")
        if plan.rally:
            self._call("rally upload", lambda: self._mission.upload_rally_points(raw_items(plan.rally, PlanKind.RALLY)))
            print(f"rally points: {len(plan.rally)} uploaded")

    def _upload_mission(self, items: list[Any]) -> None:
        """With progress, because a plan over a radio takes its time."""
        from mavsdk.plugins.mission_raw import MissionPlan

        finished, outcome = threading.Event(), ["no answer"]

        def progress(result: Any, data: Any, _: Any) -> None:
            if result.name == "NEXT":
                show_bar(data.progress)
                return
            outcome[0] = result.name
            finished.set()

        self._mission.upload_mission_with_progress_async(MissionPlan(items), progress)
        finished.wait(_TRANSFER_S)
        show_bar(None)
        if outcome[0] != "SUCCESS":
            raise LinkError(f"mission upload: {outcome[0].lower().replace('_', ' ')}")

    def download(self) -> PlanFile:
        """Everything that the vessel has. Raises LinkError."""
        mission = self._fetch("mission download", self._mission.download_mission)
        fence = self._fetch("fence download", self._mission.download_geofence)
        rally = self._fetch("rally download", self._mission.download_rallypoints)
        home = None
        if self.home_item and mission:
            place = mission[0]
            if place.x or place.y:
                home = place_rad(place)
            mission = without_home(mission)
        return PlanFile(mission, fence, rally, home, "vessel")

    def accept_far(self) -> None:
        """Say the word for the plan that the vessel has: that it lies far away is meant. Raises LinkError."""
        from mavsdk.plugins.param import Param

        mission = self._fetch("mission download", self._mission.download_mission)
        number = plan_number(plan_id(without_home(mission) if self.home_item else mission))
        self._call(FAR_OK, lambda: Param(self._system).set_param_float(FAR_OK, float(number)))
        print(f"{FAR_OK} = {number}: accepted for this plan, however far away it lies")

    def setting(self, name: str) -> float:
        """The vessel's parameter of that name. Raises LinkError."""
        from mavsdk.plugins.param import Param

        return float(self._call(name, lambda: Param(self._system).get_param_float(name)))

    def start(self, *, arm: bool) -> None:
        """Arm if asked, then sail. What this armed and could not start is disarmed again. Raises LinkError."""
        with self.arming(arm=arm):
            self._call("start", self._mission.start_mission)
        print("started")

    @contextmanager
    def arming(self, *, arm: bool = True) -> Iterator[None]:
        """Arm, if asked, for the order that is given inside; when that fails or is interrupted, what this armed is disarmed again.

        Nobody stays who would, and an armed vessel that loses its ground station sets off for home. Raises LinkError.
        """
        was_armed, accepted = not arm or self.is_armed, False
        try:
            if arm:
                self.arm()
            accepted = True
            yield
        except BaseException as error:
            # whether an order to arm that was interrupted, or not answered, was carried out is not known
            if not was_armed and (accepted or self.is_armed or not isinstance(error, LinkError)):
                self._disarm_again()
            raise

    def disarm(self) -> None:
        """Disarm. Raises LinkError."""
        self.command("disarm", Cmd.COMPONENT_ARM_DISARM, 0.0)
        print("disarmed")

    def _disarm_again(self) -> None:
        try:
            self.command("disarm", Cmd.COMPONENT_ARM_DISARM, 0.0)
        except LinkError as error:
            print(f"{error}: the vessel may still be armed, disarm it", file=sys.stderr)
        else:
            print("disarmed again", file=sys.stderr)

    @property
    def is_armed(self) -> bool:
        """Whether the vessel's heartbeat says armed; waits for the first."""
        until_s = time.monotonic() + _HEARTBEAT_S
        while self._armed is None and time.monotonic() < until_s:
            time.sleep(0.05)
        return bool(self._armed)

    def arm(self) -> None:
        """Arm, with patience: the vessel wants to have heard this ground station's heartbeat first."""
        from mavsdk.plugins.action import Action

        action = Action(self._system)
        until_s = time.monotonic() + _ARM_S
        self._refusals = []
        try:
            while not self._arms(action, until_s):
                time.sleep(0.5)
        except BaseException:
            for text in self._refusals:
                self._show(text)
            raise
        finally:
            self._refusals = None

    def _arms(self, action: Any, until_s: float) -> bool:
        """Ask once. Raises LinkError for a refusal when patience is over."""
        try:
            self._call("arm", action.arm)
        except LinkError:
            if time.monotonic() > until_s:
                raise
            return False
        return True

    def watch(self) -> None:
        """Stay connected, so that the vessel is not without a ground station, until the plan has been sailed."""
        from mavsdk.plugins.mavlink_direct import MavlinkDirect

        watch, direct = PlanWatch(home_item=self.home_item), MavlinkDirect(self._system)
        direct.subscribe_message(MISSION_CURRENT, lambda message, _: watch.take(json.loads(message.fields_json)))
        while not (watch.is_over or (watch.knows_no_state and self._mission.is_mission_finished())):
            time.sleep(_LOOK_S)
        print("finished")

    def pause(self) -> None:
        self._call("pause", self._mission.pause_mission)
        print("holding")

    def hand_over(self) -> None:
        """Give command back before leaving, so that the station that stays commands, and not one that has just gone silent.

        Without an answer nothing is worse than without asking: the vessel holds when its time-out ends.
        """
        try:
            self._answer(Cmd.REQUEST_OPERATOR_CONTROL, ())
        except LinkError as error:
            print(f"command was not handed over: {error}", file=sys.stderr)

    def command(self, what: str, number: int, *params: float) -> None:
        """Give any command; ``what`` the vessel is to do. Raises LinkError when it is refused or not answered."""
        if self._answer(number, params) != 0:
            raise LinkError(f"the vessel refuses to {what}")

    @property
    def is_heard(self) -> bool:
        """Whether the vessel's heartbeat comes."""
        return bool(self._system.is_connected())

    def _answer(self, number: int, params: Sequence[float]) -> int:
        """Send a command and return the MAV_RESULT of its answer. Raises LinkError when there is none."""
        from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkDirectError, MavlinkMessage

        system = self._system.get_system_id()
        fields = {"target_system": system, "target_component": 1, "command": number, "confirmation": 0}
        fields |= {f"param{k + 1}": params[k] if k < len(params) else 0.0 for k in range(7)}
        message = MavlinkMessage(
            "COMMAND_LONG", target_system_id=system, target_component_id=1, fields_json=json.dumps(fields)
        )
        try:
            answer = MavlinkDirect(self._system).send_command(message)
        except MavlinkDirectError as error:
            raise LinkError(f"command {number}: no answer") from error
        return int(json.loads(answer.fields_json).get("result", -1))

    def clear(self, *, fence: bool) -> None:
        """Empty the mission, and the fence unless it is kept. Raises LinkError."""
        from mavsdk.plugins.geofence import Geofence

        self._call("clear", self._mission.clear_mission)
        if fence:
            self._call("clear fence", Geofence(self._system).clear_geofence)
        print("cleared")

    def _fetch(self, what: str, call: Callable[[], Sequence[Any]]) -> tuple[PlanItem, ...]:
        return tuple(plan_item(raw) for raw in self._call(what, call))

    @staticmethod
    def _call(what: str, call: Callable[[], Any]) -> Any:
        """Run a MAVSDK call and turn its complaint into ours."""
        try:
            return call()
        except Exception as error:
            result = getattr(error, "result", None)
            text = (
                result.name.lower().replace("_", " ") if result is not None and hasattr(result, "name") else str(error)
            )
            if "no mission" in text:
                return ()
            raise LinkError(f"{what}: {text}") from error

"""Operator dead, somebody else alive: what the boat does on the water, whoever beats on whatever link (security trial §1.8)."""

from __future__ import annotations

import math

import pytest

from companion.io.links import Received
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.ashore import Ashore
from tests.fake_vessel import Station
from tests.world_station import GCS_HEARTBEAT, Helm

WAYPOINT, SET_MODE, ARM, TAKE = 16, 176, 400, 32100
AUTO, RTL, HOLD = 10.0, 11.0, 4.0
OPERATORS = {"QGroundControl": (255, 190), "MAVSDK": (245, 190), "MAVProxy": (255, 230)}
SQUARE = [(-900.0, -900.0), (900.0, -900.0), (900.0, 900.0), (-900.0, 900.0)]
OTHERS = {"observer": (77, 190), "forwarder": (125, 1), "MAVProxy as forwarder": (255, 231)}


class Crew(Helm):
    """The operator on the boat's first link, and others that beat on it or on the second."""

    def __init__(self, ids=(255, 190), *overrides: str) -> None:
        self.others: list[tuple[Station, object]] = []
        super().__init__("ardurover", "depth.enabled=false", *overrides)
        self.gcs = Station(*ids)
        self.second = self.world.ground("sdk")
        self.second.poll(0)

    def beside(self, ids: tuple[int, int], *, same_link: bool) -> Station:
        other = Station(*ids)
        self.others.append((other, self.link if same_link else self.second))
        return other

    def step(self) -> None:
        if self.world.now_us % 1_000_000 == 0:
            for other, link in self.others:
                link.write(0, other.codec.encode(GCS_HEARTBEAT))
        super().step()
        for event in self.second.poll(self.world.now_us) if self.others else ():
            if isinstance(event, Received):
                for other, _ in self.others:
                    other.receive(event.data, self.world.now_us)

    def other_orders(self, number: int, *params: float) -> int:
        """The first of the others gives a command; returns the result."""
        other, link = self.others[0]
        values = [*params, *([0.0] * (7 - len(params)))]
        other.clear()
        link.write(0, other.codec.encode(dialect.MAVLink_command_long_message(1, 1, number, 0, *values)))
        self.until(lambda: bool([m for m in other.all("COMMAND_ACK") if m.command == number and m.result != 5]), 3.0)
        return other.all("COMMAND_ACK")[-1].result

    def sail(self) -> None:
        assert self.upload([(3, WAYPOINT, 0.0, 0.0, 0.0, math.nan, *self.at(600.0, 0.0), 0.0)]) == 0
        assert self.command(SET_MODE, 1.0, AUTO) == 0
        assert self.command(ARM, 1.0) == 0
        self.run(15.0)
        assert self.truth.u_mps > 0.5

    def vanish(self) -> float:
        """The operator falls silent; returns after how many seconds the boat holds."""
        self.present = False
        return self.until(lambda: self.world.snapshot.mode.value == "Hold", 30.0)


@pytest.mark.parametrize(
    ("operator", "other", "same_link"),
    [
        ("QGroundControl", "MAVProxy as forwarder", True),
        ("QGroundControl", "observer", False),
        ("MAVSDK", "forwarder", True),
        ("MAVSDK", "observer", False),
        ("MAVProxy", "observer", True),
        ("MAVProxy", "forwarder", False),
    ],
)
def test_the_operators_silence_counts_whoever_else_beats(operator, other, same_link):
    crew = Crew(OPERATORS[operator])
    crew.beside(OTHERS[other], same_link=same_link)
    crew.sail()
    assert 4.0 <= crew.vanish() <= 5.1, "the table's 5 s after the last beat"
    crew.run(20.0)
    assert abs(crew.truth.u_mps) < 0.4


def test_an_observer_may_hold_and_send_home_and_has_command_only_when_he_orders():
    crew = Crew()
    crew.beside((77, 190), same_link=False)
    crew.sail()
    assert crew.other_orders(SET_MODE, 1.0, HOLD) == 0
    assert crew.world.snapshot.mode.value == "Hold"
    assert "commands now" not in crew.texts()
    assert crew.command(SET_MODE, 1.0, AUTO) == 0
    assert crew.other_orders(SET_MODE, 1.0, AUTO) == 0
    assert "Station 77 over sdk commands now, not station 255 over gcs" in crew.texts().replace("\n", "")
    crew.present = False
    crew.run(20.0)
    assert crew.world.snapshot.mode.value == "Auto", "the new commander is there"


def test_after_the_operators_death_one_order_of_another_goes_on():
    crew = Crew()
    crew.beside((77, 190), same_link=False)
    crew.sail()
    crew.vanish()
    assert crew.other_orders(SET_MODE, 1.0, AUTO) == 0
    crew.run(30.0)
    assert crew.world.snapshot.mode.value == "Auto"
    assert crew.truth.u_mps > 0.5


def test_one_order_without_a_heartbeat_counts_for_the_timers_time_only():
    """Security trial: one go-to, then nobody for 240 s; the boat sailed on until the depth guard."""
    crew = Crew()
    crew.sail()
    crew.vanish()
    assert crew.command(SET_MODE, 1.0, AUTO) == 0
    assert crew.world.snapshot.mode.value == "Auto"
    assert crew.until(lambda: crew.world.snapshot.mode.value == "Hold", 10.0) <= 5.2
    assert crew.until(lambda: crew.world.snapshot.mode.value == "Return", 70.0) <= 60.2


def test_with_ids_a_viewer_is_refused_by_name_and_may_still_stop_the_boat():
    crew = Crew((255, 190), 'operator.ids=["255/190"]')
    viewer = crew.beside((77, 190), same_link=False)
    crew.sail()
    assert crew.other_orders(SET_MODE, 1.0, RTL) == 0, "the way home"
    assert crew.command(SET_MODE, 1.0, AUTO) == 0
    assert crew.other_orders(SET_MODE, 1.0, 15.0) != 0
    assert any("no operator here" in m.text for m in viewer.all("STATUSTEXT"))
    assert crew.world.snapshot.mode.value == "Auto"
    assert crew.other_orders(TAKE, 0.0, 1.0) == 2
    assert crew.other_orders(ARM, 0.0) == 0
    assert not crew.world.snapshot.armed


class Beside(Crew):
    """The first of the others uploads and sets."""

    def says(self, message) -> None:
        other, link = self.others[0]
        link.write(0, other.codec.encode(message))

    def other_uploads(self, *points, kind=0) -> int:
        """Upload waypoints over the second link, whose persona has no home item; returns MAV_MISSION_RESULT."""
        other, _ = self.others[0]
        items = [(3, WAYPOINT, 0.0, 0.0, 0.0, math.nan, *self.at(*point), 0.0) for point in points]
        other.clear()
        self.says(dialect.MAVLink_mission_count_message(1, 1, len(items), kind))
        sent = set()
        while not other.all("MISSION_ACK"):
            for seq in [m.seq for m in other.all("MISSION_REQUEST_INT") if m.seq not in sent]:
                sent.add(seq)
                frame, command, *rest = items[seq]
                self.says(dialect.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *rest, kind))
            self.step()
        self.run(0.5)
        return other.last("MISSION_ACK").type

    def other_sets(self, name, value) -> None:
        self.says(dialect.MAVLink_param_set_message(1, 1, name, value, 9))
        self.run(0.5)

    @property
    def told(self) -> str:
        return self.texts().replace("\n", "")


def test_with_ids_a_viewer_turns_the_boat_by_no_plan_no_home_no_fence_and_no_parameter():
    crew = Beside((255, 190), 'operator.ids=["255/190"]')
    viewer = crew.beside((77, 190), same_link=False)
    assert crew.other_uploads((-300.0, 0.0)) == 14, "nor before it is armed"
    assert "Plan refused: station 77 over sdk is no operator here" in "".join(m.text for m in viewer.all("STATUSTEXT"))
    crew.sail()
    home = crew.world.app.vehicle.parts.mission.home
    assert crew.other_uploads((-300.0, 0.0)) == 14
    assert crew.other_uploads(kind=1) == 14
    away = [each / 1e7 for each in crew.at(-80.0, 0.0)]
    assert crew.other_orders(179, 0.0, 0.0, 0.0, 0.0, *away) == 1
    assert crew.other_orders(207, 0.0) == 1
    crew.other_sets(b"CRUISE_SPEED", 0.5)
    assert viewer.all("PARAM_ERROR")
    mission = crew.world.app.vehicle.parts.mission
    assert (mission.home, len(mission.plan.maneuvers), mission.config.cruise_speed_mps) == (home, 1, 1.5)
    crew.run(10.0)
    assert crew.truth.u_mps > 0.5
    assert crew.world.snapshot.mode.value == "Auto"


def test_who_may_command_sets_what_stands_without_taking_command_and_the_commander_is_told():
    crew = Beside()
    crew.beside((77, 190), same_link=False)
    assert crew.other_uploads((500.0, 0.0)) == 0, "lying in port nobody need know"
    assert "replaced" not in crew.told
    crew.sail()
    assert crew.other_uploads((-300.0, 0.0)) == 0
    assert crew.other_orders(179, 1.0) == 0
    assert crew.other_orders(207, 0.0) == 0
    crew.other_sets(b"CRUISE_SPEED", 0.75)
    crew.run(1.0)
    for words in ("replaced the plan", "set home here", "switched the fence off", "set CRUISE_SPEED to 0.75"):
        assert f"Station 77 over sdk {words}" in crew.told
    assert "commands now" not in crew.told
    assert crew.world.app.vehicle.parts.operators.commander.system == 255


def test_a_command_that_another_link_undid_is_not_confirmed_and_obeyed_to_who_insists():
    """Each connection remembers its own answers; the fence was off while the operator had read ACCEPTED."""
    crew = Beside()
    crew.beside((255, 190), same_link=False)
    crew.upload([(3, 5001, 4.0, 0.0, 0.0, 0.0, *crew.at(*corner), 0.0) for corner in SQUARE], kind=1)
    fence = crew.world.app.vehicle.parts.fence
    assert crew.command(207, 1.0) == 0
    assert crew.other_orders(207, 0.0) == 0
    assert crew.command(207, 1.0) == 1
    assert not fence.enabled
    crew.run(3.0)
    assert crew.command(207, 1.0) == 0
    assert fence.enabled
    crew.other_sets(b"FENCE_ENABLE", 0.0)
    crew.run(0.2)
    assert crew.command(207, 1.0) == 1
    assert not fence.enabled


@pytest.mark.parametrize("same_link", [True, False])
def test_with_ids_system_0_is_nobody_and_opens_the_door_to_nobody(same_link):
    """Its HEARTBEAT once made everybody on its connection "the gateway", which may always command."""
    crew = Crew((255, 190), 'operator.ids=["255/190"]')
    nobody, viewer = crew.beside((0, 0), same_link=same_link), Station(77, 190)
    crew.sail()
    for station in (nobody, viewer, nobody, viewer):
        link = crew.link if same_link else crew.second
        link.write(0, station.codec.encode(dialect.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, 15, *[0.0] * 5)))
        crew.run(3.0)
        assert crew.world.snapshot.mode.value == "Auto"


def test_the_command_can_be_asked_for_and_given_back_without_motion():
    crew = Crew()
    crew.beside((77, 190), same_link=False)
    crew.sail()
    assert crew.other_orders(TAKE, 0.0, 1.0) == 0
    crew.present = False
    crew.run(20.0)
    assert crew.world.snapshot.mode.value == "Auto"
    assert crew.other_orders(TAKE, 0.0, 0.0) == 0
    crew.present = True
    crew.run(2.0)
    crew.others.clear()
    crew.run(20.0)
    assert crew.world.snapshot.mode.value == "Auto", "nobody commands: whoever is there counts"


def test_the_gateway_tells_the_boat_of_its_commanding_station_only(tmp_path):
    shore = Ashore(tmp_path, observed=True)
    shore.run(30.0)
    shore.order(ARM, 1.0)
    shore.order(192, -1.0, 1.0, 0.0, math.nan, *(each / 1e7 for each in (0, 0)))
    assert shore.world.snapshot.armed
    shore.run(75.0)
    assert not any("Ground station" in item for item in shore.texts()), "the commander is there"
    shore.present = False
    shore.run(80.0)
    assert any("over the radio: HOLD" in item for item in shore.texts()), "an observer at the gateway is nobody"

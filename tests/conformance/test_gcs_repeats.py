"""Commands that come again: what was not answered, what was pressed again, and what somebody else has overruled meanwhile.

ACCEPTED means that the vessel is as the command wants it; and no repeat starts a boat that somebody stopped.
"""

import pytest

from mavlink_bridge.language import requests as ask
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Reply, Result
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from tests.fake_vessel import Station
from tests.world_station import Helm

ACCEPTED, REJECTED, IN_PROGRESS = 0, 1, 5
AUTO, HOLD, MANUAL = (176, 1, 10), (176, 1, 4), (176, 1, 0)
ARM, DISARM, START, PAUSE, GO_ON = (400, 1), (400, 0), (300,), (193, 0), (193, 1)


class Two:
    """A station, and others on the same link; each press is followed by a fifth of a second."""

    def __init__(self, bench):
        self.bench = bench
        self.vessel = bench.vessel
        self.vessel.plans.stored[ask.PlanKind.MISSION] = (
            ask.PlanItem(16, 3, 0, 0, 0, 0, 411_840_000, -87_050_000, 0.0),
        )
        self.others = 0

    def press(self, command, station=None, confirmation=0):
        number, *params = command
        values = [*params, *([0.0] * (7 - len(params)))]
        self.bench.gcs.clear()
        message = dialect.MAVLink_command_long_message(1, 1, number, confirmation, *values)
        self.bench.send(message, station)
        self.bench.run(0.2)
        return self.bench.acked(number)

    def b(self, command):
        """Somebody else presses, who has not pressed before."""
        self.others += 1
        assert self.press(command, Station(200 + self.others, 190)) == [ACCEPTED]

    def stopped(self, command):
        """Whether a stop has taken effect."""
        return not self.vessel.armed if command == DISARM else self.vessel.mode is Mode.HOLD


@pytest.fixture
def two(bench):
    return Two(bench)


def by_another_station(two):
    two.b(ARM)
    two.b(AUTO)


def by_set_mode(two):
    two.bench.send(dialect.MAVLink_set_mode_message(1, 1, 10))
    two.vessel.armed = True
    two.bench.run(0.2)


def by_itself(two):
    """A failsafe, another link, the command line: the endpoint sees only what becomes of the vessel."""
    two.vessel.mode, two.vessel.armed = Mode.RTL, True
    two.bench.run(0.2)


@pytest.mark.parametrize("overrule", [by_another_station, by_set_mode, by_itself])
@pytest.mark.parametrize("stop", [HOLD, PAUSE, DISARM])
def test_a_stop_is_carried_out_at_every_press_whoever_set_the_boat_moving_since(two, stop, overrule):
    for _ in range(5):
        assert two.press(stop) == [ACCEPTED]
        assert two.stopped(stop)
        overrule(two)
        assert not two.stopped(stop)


def test_a_stop_pressed_in_haste_gets_through(two):
    """Each press comes less than 3 s after the last; the boat is set going again between them."""
    two.press(HOLD)
    for _ in range(8):
        two.b(AUTO)
        two.bench.run(0.5)
        assert two.press(HOLD) == [ACCEPTED]
        assert two.vessel.mode is Mode.HOLD


@pytest.mark.parametrize("rate_hz", [20, 50, 100])
def test_a_stream_of_set_points_does_not_make_a_stop_look_late(two, rate_hz):
    point = dialect.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0x1C7, *([0] * 11))

    def stream(seconds):
        for _ in range(round(seconds * 20)):
            for _ in range(rate_hz // 20):
                two.bench.send(point)
            two.bench.tick()

    two.bench.long(*HOLD)
    stream(0.5)
    two.bench.long(176, 1, 15)
    stream(1.4)
    for _ in range(4):
        two.vessel.mode = Mode.GUIDED
        two.bench.long(*HOLD)
        stream(0.5)
        assert two.vessel.mode is Mode.HOLD


def test_a_late_copy_of_a_stop_does_not_undo_a_newer_order(two):
    copy = two.bench.gcs.codec.encode(dialect.MAVLink_command_long_message(1, 1, 176, 1, 1, 4, 0, 0, 0, 0, 0))
    assert two.press(HOLD) == [ACCEPTED]
    assert two.press(AUTO) == [ACCEPTED]
    two.bench.endpoint.receive(copy, two.vessel.now_us)
    two.bench.run(0.2)
    assert two.vessel.mode is Mode.AUTO


@pytest.mark.parametrize(
    ("go", "stop"), [(START, HOLD), (START, DISARM), (AUTO, PAUSE), (GO_ON, HOLD), (ARM, DISARM), ((20,), HOLD)]
)
@pytest.mark.parametrize("wait_s", [0.0, 1.0, 2.2])
def test_a_repeat_does_not_start_the_boat_after_somebody_stopped_it(two, go, stop, wait_s):
    """The answer to the first was lost; the station repeats it by itself, and must not hear that it was done."""
    two.vessel.armed = True
    assert two.press(go) == [ACCEPTED]
    two.b(stop)
    two.bench.run(wait_s)
    assert two.press(go, confirmation=1) == [REJECTED]
    assert "Overruled since" in two.bench.texts()
    assert two.press(go) == [REJECTED]
    assert two.stopped(stop)


def test_a_counted_repeat_does_not_undo_the_stations_own_stop(two):
    two.vessel.armed = True
    two.press(START)
    two.press(HOLD)
    assert two.press(START, confirmation=1) == [REJECTED]
    assert two.vessel.mode is Mode.HOLD
    assert two.press(START) == [ACCEPTED]
    assert two.vessel.mode is Mode.AUTO


def test_who_insists_is_obeyed_after_three_seconds_however_often_he_pressed(two):
    assert two.press(ARM) == [ACCEPTED]
    two.b(DISARM)
    pressed = 0
    while not two.vessel.armed:
        two.press(ARM)
        pressed += 1
        assert pressed < 20
    assert 2.4 <= 0.2 * pressed <= 3.2


@pytest.mark.parametrize(("first", "second"), [((178, 1, 2.0), (178, 1, 1.0)), ((207, 1), (207, 0))])
def test_a_value_that_another_station_set_since_is_not_confirmed(two, first, second):
    assert two.press(first) == [ACCEPTED]
    two.b(second)
    assert two.press(first) == [REJECTED]


NAN = float("nan")
AT_X, AT_Y = (192, -1, 1, 0, NAN, 41.18, -8.70, 0), (192, -1, 1, 0, NAN, 41.19, -8.70, 0)
FENCE_ON, SPEED, HOME = (207, 1), (178, 1, 2.0), (179, 0, 0, 0, 0, 41.18, -8.70, 0)
ELSEWHERE = {
    FENCE_ON: [ask.EnableFence(False), ask.SetParameter("FENCE_ENABLE", 0.0), ask.LoadPlan(ask.PlanKind.FENCE, ())],
    SPEED: [ask.SetSpeed(1.0), ask.SetParameter("CRUISE_SPEED", 1.0), ask.StartPlan()],
    HOME: [ask.SetHomePosition(0.7, 0.1)],
    AT_X: [ask.Reposition(0.7, 0.1), ask.Orbit(0.7, 0.1), ask.GuidedTarget(0.7, 0.1), ask.SetMode(Mode.HOLD)],
    (224, 0): [ask.SetCurrent(2), ask.StartPlan(1), ask.LoadPlan(ask.PlanKind.MISSION, ())],
    (32100, 0, 1): [ask.TakeCommand(), ask.SetMode(Mode.AUTO)],
}


@pytest.mark.parametrize(
    ("command", "undone_by"), [(command, body) for command, bodies in ELSEWHERE.items() for body in bodies]
)
def test_what_was_undone_over_another_link_is_not_confirmed(two, command, undone_by):
    """Each link has its own memory of answers: what came over others it learns from the vessel."""
    assert two.press(command) == [ACCEPTED]
    two.vessel.deeds.note(undone_by)
    assert two.press(command) == [REJECTED]
    assert "Overruled since" in two.bench.texts()
    assert two.press(command, confirmation=1) == [REJECTED]
    assert len(two.vessel.handled) == 1
    two.bench.run(3.0)
    assert two.press(command) == [ACCEPTED]
    assert len(two.vessel.handled) == 2


@pytest.mark.parametrize("command", ELSEWHERE)
def test_a_repeat_is_answered_from_memory_whatever_else_others_did(two, command):
    """The answer was lost: nothing is done twice, and nothing that was done is denied."""
    others = [ask.RunPrearmChecks(), ask.DistanceInput(4.0), ask.ManualInput(0.0, 0.0, 77), ask.UnlockGuard()]
    others += [ask.SetParameter("LOIT_RADIUS", 9.0)] if command not in (FENCE_ON, SPEED) else []
    others += [ask.SetHomePosition(0.1, 0.1)] if command != HOME else [ask.EnableFence(False)]
    assert two.press(command) == [ACCEPTED]
    for body in others:
        two.vessel.deeds.note(body)
    for confirmation in (0, 1, 2):
        assert two.press(command, confirmation=confirmation) == [ACCEPTED]
    assert len(two.vessel.handled) == 1


def test_a_station_that_changes_its_mind_twice_is_obeyed_each_time(two):
    for command in (AT_X, AT_Y, AT_X, FENCE_ON, (207, 0), FENCE_ON):
        assert two.press(command) == [ACCEPTED]
    assert len(two.vessel.handled) == 6


def test_what_a_station_ordered_itself_since_denies_none_of_its_repeats(two):
    for command in (ARM, AT_X, (178, 1, 2.0), (176, 1, 15)):
        two.press(command)
    assert two.press(AT_X, confirmation=1) == [ACCEPTED]
    assert two.press(ARM, confirmation=1) == [ACCEPTED]
    assert len(two.vessel.handled) == 4


def test_a_refused_command_is_judged_anew_however_fast_it_is_pressed(two):
    two.vessel.refuse[ask.Arm] = Reply(Result.REJECTED_NOW, "no position yet")
    assert two.press(ARM) == [REJECTED]
    two.vessel.refuse.clear()
    results = [two.press(ARM) for _ in range(3)]
    assert results[-1] == [ACCEPTED]
    assert two.vessel.armed


def test_a_failsafes_return_ends_at_hold_pressed_once_a_second():
    """On a whole vessel: Hold, the vessel returns by itself, Hold."""
    helm = Helm("ardurover")
    assert helm.command(400, 1) == ACCEPTED
    for _ in range(4):
        assert helm.command(176, 1, 4) == ACCEPTED
        helm.world.app.submit(ask.SetMode(Mode.RTL))
        helm.run(0.6)
        assert helm.world.snapshot.mode is Mode.RTL
    assert helm.command(176, 1, 4) == ACCEPTED
    assert helm.world.snapshot.mode is Mode.HOLD


def uncounted(message, number=0):
    """A frame of the station's that always has this number."""
    codec = Codec(255, 190)
    for _ in range(number):
        codec.encode(message)
    return codec.encode(message)


def long(command):
    number, *params = command
    return dialect.MAVLink_command_long_message(1, 1, number, 0, *params, *([0.0] * (7 - len(params))))


@pytest.mark.parametrize("numbers", [(0, 0), (5, 6)], ids=["one number", "frames made beforehand"])
@pytest.mark.parametrize("stop", [DISARM, HOLD, PAUSE])
def test_who_does_not_count_his_frames_stops_the_boat_each_time(two, stop, numbers):
    """Scripts send the same bytes again; a router's copies are the same bytes too, and stop what is stopped already."""
    two.vessel.armed = True
    for _ in range(3):
        two.bench.gcs.clear()
        two.bench.endpoint.receive(uncounted(long(stop), numbers[0]), two.vessel.now_us)
        two.bench.run(0.2)
        assert two.stopped(stop)
        assert two.bench.acked(stop[0]) == [ACCEPTED]
        two.b(ARM)
        two.b(AUTO)
    set_hold = dialect.MAVLink_set_mode_message(1, 1, 4)
    for _ in range(3):
        two.bench.endpoint.receive(uncounted(set_hold, numbers[1]), two.vessel.now_us)
        two.bench.run(0.2)
        assert two.vessel.mode is Mode.HOLD
        two.b(AUTO)


@pytest.mark.parametrize("stop", [DISARM, HOLD, PAUSE])
def test_the_very_frame_that_stopped_the_boat_is_answered_and_not_carried_out_while_nothing_has_happened(two, stop):
    two.vessel.mode, two.vessel.armed = Mode.AUTO, True
    for _ in range(3):
        two.bench.gcs.clear()
        two.bench.endpoint.receive(uncounted(long(stop)), two.vessel.now_us)
        two.bench.run(0.2)
        assert two.bench.acked(stop[0]) == [ACCEPTED]
    assert len(two.vessel.handled) == 1
    by_itself(two)
    two.bench.endpoint.receive(uncounted(long(stop)), two.vessel.now_us)
    two.bench.run(0.2)
    assert two.stopped(stop), "the vessel set itself going"


def test_who_does_not_count_his_frames_hears_an_answer_to_each(two):
    two.bench.gcs.clear()
    for _ in range(4):
        two.bench.endpoint.receive(uncounted(long(ARM)), two.vessel.now_us)
        two.bench.run(0.2)
    assert two.bench.acked(400) == [ACCEPTED] * 4
    assert len(two.vessel.handled) == 1, "from memory"


def test_sticks_of_who_does_not_count_his_frames_do_not_pause(two):
    """Sticks that are held still are the same bytes; neutral after 0.5 s would stop the boat in bursts."""
    sticks = dialect.MAVLink_manual_control_message(1, 0, 0, 400, 0, 0)
    for tick in range(60):
        if tick % 10 == 0:
            two.bench.endpoint.receive(
                uncounted(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), 150), two.vessel.now_us
            )
        two.bench.endpoint.receive(uncounted(sticks, 7), two.vessel.now_us)
        two.bench.tick()
    assert len([each for each in two.vessel.handled if isinstance(each.body, ask.ManualInput)]) == 60


def test_a_copy_by_a_longer_way_undoes_nothing_that_its_sender_ordered_since(two):
    """The same bytes, 0.8 s late: neither the start before the stop, nor where the sticks were."""
    two.press(ARM)
    codec = two.bench.gcs.codec
    start = codec.encode(long(START))
    ahead = codec.encode(dialect.MAVLink_manual_control_message(1, 0, 0, 400, 0, 0))
    for data in (start, ahead, codec.encode(dialect.MAVLink_manual_control_message(1, 0, 0, 0, 0, 0))):
        two.bench.endpoint.receive(data, two.vessel.now_us)
    two.bench.run(0.1)
    assert two.press(HOLD) == [ACCEPTED]
    two.bench.run(0.6)
    handled = len(two.vessel.handled)
    for data in (start, ahead):
        two.bench.endpoint.receive(data, two.vessel.now_us)
    two.bench.run(0.2)
    assert two.vessel.mode is Mode.HOLD
    assert len(two.vessel.handled) == handled
    assert two.bench.endpoint.counters.copies == 2


def begun_anew(after_messages):
    """Station 255 as a program that has said so much since it began."""
    station = Station(255, 190)
    for _ in range(after_messages):
        station.codec.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    return station


def test_a_station_whose_program_begins_anew_starts_what_it_paused_itself(two):
    """Each call of a command line is a program of its own: the same station, numbers from 0, seconds after the last."""
    two.press(ARM)
    for go, stop in ((AUTO, HOLD), (GO_ON, PAUSE), (AUTO, PAUSE)):
        assert two.press(go, begun_anew(4)) == [ACCEPTED]
        two.press(stop, begun_anew(40))
        assert two.vessel.mode is Mode.HOLD
        two.bench.run(0.6)
        assert two.press(go, begun_anew(6)) == [ACCEPTED]
        assert two.vessel.mode is Mode.AUTO


class Slow(Two):
    """As over a radio: what is asked of the vessel is answered when the test says so."""

    def order(self, command, confirmation=0):
        """What is asked of the vessel for one press."""
        number, *params = command
        values = [*params, *([0.0] * (7 - len(params)))]
        self.bench.send(dialect.MAVLink_command_long_message(1, 1, number, confirmation, *values))
        return self.bench.endpoint.requests()

    def answer(self, request, reply):
        self.bench.gcs.clear()
        if reply.result is Result.ACCEPTED:
            self.vessel.handle(request)
            self.vessel.deeds.note(request.body)
        self.bench.endpoint.reply(request.id, reply, self.vessel.now_us)
        self.bench.run(0.1)
        return self.answers()

    def answers(self):
        """The final acknowledgements."""
        results = [message.result for message in self.bench.gcs.all("COMMAND_ACK")]
        return [result for result in results if result != IN_PROGRESS]


@pytest.fixture
def slow(bench):
    return Slow(bench)


ABA = [(HOLD, AUTO), (AUTO, HOLD), (DISARM, ARM), (ARM, DISARM), (PAUSE, GO_ON), (AT_X, AT_Y)]
ABA += [(SPEED, (178, 1, 1.0)), (FENCE_ON, (207, 0)), (START, HOLD), (AT_X, (34, 20.0)), ((43002, 1, 90), AT_X)]


@pytest.mark.parametrize(("first", "second"), ABA)
def test_an_order_is_new_after_its_contrary_though_the_first_has_no_answer_yet(slow, first, second):
    for command in (first, second, first):
        (request,) = slow.order(command)
        slow.bench.run(0.3)
    assert slow.answer(request, ask.ACCEPTED) == [ACCEPTED]


@pytest.mark.parametrize(("first", "second"), ABA)
def test_three_orders_of_one_tick_are_carried_out_in_their_order(two, first, second):
    for number, *params in (first, second, first):
        two.bench.long(number, *params)
    two.bench.run(0.2)
    bodies = [request.body for request in two.vessel.handled]
    assert len(bodies) == 3
    assert bodies[0] == bodies[2] != bodies[1]


def test_an_order_is_new_after_its_contrary_though_the_contrary_is_forgotten(slow):
    """Its answer was long ago; the first one's never came."""
    slow.order(HOLD)
    (start,) = slow.order(AUTO)
    slow.answer(start, ask.ACCEPTED)
    slow.bench.run(5.0)
    assert slow.order(HOLD)


@pytest.mark.parametrize("command", [ARM, AUTO, START, GO_ON, AT_X, SPEED, FENCE_ON])
def test_a_mere_repeat_is_asked_of_the_vessel_once(slow, command):
    assert len(slow.order(command)) == 1
    for confirmation in (0, 1, 2):
        slow.bench.run(0.5)
        assert slow.order(command, confirmation) == []
        if command != SPEED:
            slow.order(SPEED)
        assert slow.order(command, confirmation) == []


@pytest.mark.parametrize(("first", "second"), [(ARM, DISARM), (AUTO, HOLD), (AT_X, AT_Y), (HOLD, AUTO)])
@pytest.mark.parametrize("reply", [Reply(Result.REJECTED_NOW, "overruled by a stop"), ask.ACCEPTED])
def test_the_answer_to_an_order_that_was_overtaken_is_not_taken_for_the_newer_ones(slow, first, second, reply):
    (older,) = slow.order(first)
    slow.bench.run(0.3)
    (newer,) = slow.order(second)
    assert slow.answer(older, reply) == []
    assert "overruled" not in slow.bench.texts().lower()
    assert slow.answer(newer, ask.ACCEPTED) == [ACCEPTED]
    slow.bench.gcs.clear()
    slow.bench.run(20.0)
    assert slow.answers() == []


def test_a_counted_repeat_does_not_start_the_boat_that_its_station_stopped_before_it_started(slow):
    """The start was overruled on its way: it was refused, and is not judged anew for the station's own repeats."""
    (start,) = slow.order(AUTO)
    slow.bench.run(0.3)
    slow.order(HOLD)
    slow.answer(start, Reply(Result.REJECTED_NOW, "overruled by a stop"))
    slow.bench.run(1.0)
    assert slow.order(AUTO, confirmation=1) == []


@pytest.mark.parametrize(
    "changed",
    [ask.LoadPlan(ask.PlanKind.MISSION, ()), ask.SetParameter("FENCE_ENABLE", 0.0), ask.EnableFence(enable=False)],
)
def test_a_refused_start_is_judged_anew_at_once_when_a_plan_was_stored_or_a_setting_changed(slow, changed):
    """Refused without a plan; a script uploads one and starts: the reason of a moment ago is none any more."""
    (start,) = slow.order(START)
    assert slow.answer(start, Reply(Result.REJECTED_NOW, "no plan is loaded")) == [REJECTED]
    assert slow.order(START) == [], "the same words a moment later get the same answer"
    slow.vessel.deeds.note(changed)
    (again,) = slow.order(START)
    assert slow.answer(again, ask.ACCEPTED) == [ACCEPTED]
    slow.vessel.deeds.note(changed)
    assert slow.order(START) == [], "what was carried out is not begun twice for it"


def test_an_order_of_somebody_else_does_not_have_a_refused_one_judged_anew(slow):
    (start,) = slow.order(START)
    slow.answer(start, Reply(Result.REJECTED_NOW, "no plan is loaded"))
    slow.vessel.deeds.note(ask.SetSpeed(1.0))
    assert slow.order(START) == []


def set_mode(number):
    return dialect.MAVLink_set_mode_message(1, 1, number)


def go_to(x=411_800_000):
    return dialect.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, x, -87_000_000, 0, 0)


@pytest.mark.parametrize(
    ("message", "mode", "text"),
    [(set_mode(10), Mode.AUTO, "Overruled since"), (go_to(), Mode.GUIDED, "overruled since")],
    ids=["SET_MODE", "mission item"],
)
class TestOrdersThatAreNoCommands:
    """SET_MODE, and a mission item with current = 2: they have the same memory as the commands that mean the same."""

    def test_a_repeat_does_not_start_the_boat_after_somebody_stopped_it(self, two, message, mode, text):
        two.bench.send(message)
        two.bench.run(0.2)
        assert two.vessel.mode is mode
        two.b(HOLD)
        two.bench.run(1.0)
        two.bench.send(message)
        two.bench.run(0.2)
        assert two.vessel.mode is Mode.HOLD
        assert text in two.bench.texts()
        two.bench.run(3.0)
        two.bench.send(message)
        two.bench.run(0.2)
        assert two.vessel.mode is mode, "who insists is obeyed"

    def test_a_repeat_is_carried_out_once(self, two, message, mode, text):
        for wait_s in (0.0, 0.2, 1.0):
            two.bench.send(message)
            two.bench.run(wait_s)
        assert len(two.vessel.handled) == 1
        assert two.bench.acked(176) == []
        assert {ack.type for ack in two.bench.gcs.all("MISSION_ACK")} <= {ACCEPTED}
        assert text not in two.bench.texts()

    def test_it_is_new_after_its_senders_own_stop_answered_or_not(self, two, message, mode, text):
        for wait_s in (0.0, 0.2):
            two.bench.send(message)
            two.bench.run(wait_s)
            two.bench.long(*HOLD)
            two.bench.run(wait_s)
            two.bench.send(message)
            two.bench.run(0.2)
            assert two.vessel.mode is mode
            assert text not in two.bench.texts()

    def test_a_stop_after_it_is_carried_out(self, two, message, mode, text):
        for _ in range(3):
            two.bench.long(*HOLD)
            two.bench.send(message)
            two.bench.long(*HOLD)
            two.bench.run(0.2)
            assert two.vessel.mode is Mode.HOLD


def test_set_mode_and_the_command_are_one_order_and_the_command_is_acknowledged(two):
    two.bench.send(set_mode(10))
    two.bench.long(*AUTO)
    two.bench.run(0.2)
    assert len(two.vessel.handled) == 1
    assert two.bench.acked(176) == [ACCEPTED]


def test_a_hold_by_set_mode_is_carried_out_each_time(two):
    for _ in range(3):
        two.bench.send(set_mode(4))
        two.bench.run(0.2)
        assert two.vessel.mode is Mode.HOLD
        two.b(AUTO)


def test_the_last_of_three_mission_items_is_where_the_boat_goes(two):
    for x in (411_800_000, 411_700_000, 411_800_000):
        two.bench.send(go_to(x))
    two.bench.run(0.2)
    places = [request.body.lat_rad for request in two.vessel.handled]
    assert len(places) == 3
    assert places[0] == places[2] > places[1]


def test_a_go_to_that_was_overtaken_is_not_refused_in_the_newer_ones_place(slow):
    slow.bench.send(go_to(411_800_000))
    slow.bench.send(go_to(411_700_000))
    older, newer = slow.bench.endpoint.requests()
    slow.answer(older, Reply(Result.REJECTED_NOW, "overruled by a newer order"))
    assert not slow.bench.gcs.all("MISSION_ACK")
    assert "Go-to refused" not in slow.bench.texts()
    slow.answer(newer, ask.ACCEPTED)
    assert [ack.type for ack in slow.bench.gcs.all("MISSION_ACK")] == [ACCEPTED]

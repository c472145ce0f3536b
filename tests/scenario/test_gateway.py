"""The gateway as a ground station's neighbour: signed links, restarts, one-item plans, in virtual time."""

from __future__ import annotations

import random

import pytest

from companion.gateway import Gateway, GatewaySettings
from companion.io.keeping.content import SaveValue
from companion.io.keeping.keys import write_key
from companion.io.keeping.shore_picture import PICTURE_KEY
from companion.io.keeping.store import MemoryStore
from companion.io.links.mem import pair
from companion.settings.schema import ConfigError, EndpointSettings, SecurityConfig
from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.wire import item_to_message
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState
from mavlink_bridge.radio.shore.memory import ShorePicture, read, write
from sitl.gateway import simulation_key
from tests.scenario.test_radio_protocols import Shore

ARM = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
LOITER = (3, 19, 0, 1, 60.0, 0.0, 20.0, 0.0, 411_852_000, -87_060_000, 0.0)
UTC_US = 1_760_000_000_000_000
KEY = bytes(range(32))


class Later:
    """A gateway whose own clock starts at ``began_us``, as after a restart."""

    def __init__(self, gateway, began_us):
        self.gateway, self.began_us = gateway, began_us
        self.profile, self.twin = gateway.profile, gateway.twin

    def tick(self, now_us):
        self.gateway.tick(now_us - self.began_us)


def start(shore, tmp_path, *, store=None, away_s=0.0, others=None, **settings):
    """Put a fresh gateway process in the place of the present one, so many seconds later. ``others``: its further links."""
    near, shore.far = pair("gcs")
    links = {"gcs": near} | (others or {})
    settings.setdefault("endpoints", (EndpointSettings(name="gcs", url="mem:gcs"),))
    own = GatewaySettings(profile="o-10", key_file=str(simulation_key(tmp_path)), **settings)
    gateway = Gateway(
        own,
        modem=shore.sim.ground("shore"),
        make_link=lambda name, url: links[name],
        store=store or MemoryStore(),
        rng=random.Random(2),
        started_utc_us=UTC_US + round(shore.sim.now_us + away_s * 1e6),
    )
    shore.gateway = Later(gateway, shore.sim.now_us)
    shore.far.poll(0)
    shore.messages.clear()
    return gateway


def upload(shore, *items, seconds=6.0):
    """Answer the gateway's questions for items until its acknowledgement; return the acknowledgement's type."""
    shore.send(dialect.MAVLink_mission_count_message(1, 1, len(items), 0))
    seen = len(shore.messages)
    end_us = shore.sim.now_us + seconds * 1e6
    while shore.sim.now_us < end_us:
        shore.run(0.05)
        new, seen = shore.messages[seen:], len(shore.messages)
        for _, message in new:
            if message.get_type() == "MISSION_ACK":
                return message.type
            if message.get_type() == "MISSION_REQUEST_INT":
                frame, command, current, auto, *rest = items[message.seq]
                shore.send(
                    dialect.MAVLink_mission_item_int_message(1, 1, message.seq, frame, command, current, auto, *rest, 0)
                )
    return None


def test_a_restarted_gateway_shows_what_it_knew_and_how_old_it_is(tmp_path):
    shore = Shore(tmp_path, persona="generic")
    store = MemoryStore()
    start(shore, tmp_path, store=store, endpoints=(EndpointSettings(name="gcs", url="mem:gcs", persona="generic"),))
    shore.run(50.0)
    shore.send(dialect.MAVLink_param_set_message(1, 1, b"LOIT_RADIUS", 33.0, 9))
    shore.run(5.0)
    assert upload(shore, LOITER) == 0
    shore.send(ARM)
    shore.run(11.0)
    position = shore.of("GLOBAL_POSITION_INT")[-1][1]
    shore.sim.surroundings.radio.air.jammed = True

    again = start(shore, tmp_path, store=store, away_s=3.0)
    shore.run(2.0)
    assert [item.command for item in again.twin.plans.items(PlanKind.MISSION)] == [19]
    assert again.twin.params.get("LOIT_RADIUS").value == 33.0
    shown = shore.of("GLOBAL_POSITION_INT")[-1][1]
    assert (shown.lat, shown.lon) == pytest.approx((position.lat, position.lon), abs=60)
    ages = [message.value for _, message in shore.of("NAMED_VALUE_FLOAT") if message.name == "radio_age"]
    assert 3.0 < ages[-1] < 11.0
    shore.run(20.0)
    last_us = shore.of("HEARTBEAT")[-1][0]
    shore.run(10.0)
    assert shore.of("HEARTBEAT")[-1][0] == last_us

    start(shore, tmp_path, store=store, away_s=600.0)
    shore.run(5.0)
    assert not shore.of("HEARTBEAT")
    shore.sim.surroundings.radio.air.jammed = False
    shore.run(40.0)
    assert shore.of("HEARTBEAT")


def armed_as_shown(shore):
    return [bool(message.base_mode & 128) for _, message in shore.of("HEARTBEAT")]


@pytest.mark.parametrize("after_s", [0.2, 1.3, 4.0, 6.0])
def test_a_gateway_that_is_killed_shows_no_armed_vessel_as_disarmed(tmp_path, after_s):
    """Killed it stores nothing: what it had known for less than ten seconds was lost, and a sailing boat read disarmed."""
    shore = Shore(tmp_path)
    store = MemoryStore()
    start(shore, tmp_path, store=store)
    shore.run(61.0)
    shore.send(ARM)
    began_us = shore.sim.now_us
    while not any(armed_as_shown(shore)[-1:]):
        shore.run(0.1)
        assert shore.sim.now_us - began_us < 10_000_000
    shore.run(after_s)
    start(shore, tmp_path, store=store, away_s=1.0)
    shore.run(20.0)
    assert set(armed_as_shown(shore)) == {True}


def test_a_vessel_that_was_disarmed_is_shown_when_she_is_heard_and_not_before(tmp_path):
    """Another station, or an order whose answer the gateway did not live to hear, may have armed her since."""
    shore = Shore(tmp_path)
    store = MemoryStore()
    start(shore, tmp_path, store=store)
    shore.run(61.0)
    assert armed_as_shown(shore)[-1] is False
    shore.sim.surroundings.radio.air.jammed = True
    start(shore, tmp_path, store=store, away_s=1.0)
    shore.run(5.0)
    assert armed_as_shown(shore) == []
    shore.sim.surroundings.radio.air.jammed = False
    shore.run(30.0)
    assert armed_as_shown(shore)


def test_what_does_not_hold_any_more_is_asked_for(tmp_path):
    shore = Shore(tmp_path)
    store = MemoryStore()
    wrong = ShorePicture(
        params={"LOIT_RADIUS": 99.0}, plans={PlanKind.RALLY: (PlanItem(5100, 3, 0, 0, 0, 0, 1, 1, 0.0),)}
    )
    store.submit(SaveValue(PICTURE_KEY, write(wrong)))
    store.completions()
    again = start(shore, tmp_path, store=store)
    assert again.twin.params.get("LOIT_RADIUS").value == 99.0
    shore.run(90.0)
    assert again.twin.params.get("LOIT_RADIUS").value == shore.sim.app.facade.params.get("LOIT_RADIUS").value
    assert again.twin.plans.items(PlanKind.RALLY) == ()


def test_a_damaged_memory_is_forgotten():
    assert read("") is None
    assert read("{") is None
    assert read('{"plans":["00"],"unsure":[],"params":{},"home":null,"state":null,"utc":0}') is None
    assert read("[]") is None


def test_the_vessel_has_the_very_items_that_the_station_sent(tmp_path):
    """Odd values, NaN, commands without a place: a download would bring the very bytes (``current`` marks the first item)."""
    shore = Shore(tmp_path, persona="generic")
    shore.run(60.0)
    nan = float("nan")
    sent = [
        (2, 178, 1, 1, 1.0, 1.2345678, -1.0, 0.0, 0, 0, 0.0),
        (6, 16, 0, 1, 0.0, 2.7, nan, nan, 411_851_234, -87_061_111, -0.0),
        (3, 19, 0, 1, 61.25, 0.0, -20.125, 1.0, 411_852_001, -87_060_003, 7.3),
        (2, 177, 0, 1, 1.0, 2.0, 0.0, 0.0, 0, 0, 0.0),
    ]
    assert upload(shore, *sent, seconds=20.0) == 0
    codec = Codec(1, 1)
    had = shore.sim.app.facade.plans.items(PlanKind.MISSION)
    back = [codec.encode(item_to_message(item, seq, 1, 1, PlanKind.MISSION))[10:] for seq, item in enumerate(had)]
    codec = Codec(1, 1)
    for seq, (frame, command, current, auto, *rest) in enumerate(sent):
        message = dialect.MAVLink_mission_item_int_message(1, 1, seq, frame, command, current, auto, *rest, 0)
        assert codec.encode(message)[10:] == back[seq]


def test_a_one_item_plan_is_never_called_uploaded_too_soon(tmp_path):
    """One item cannot be held open beyond 1.8 s: an error, and a text when the vessel has stored it after all."""
    shore = Shore(tmp_path, persona="generic")
    shore.run(60.0)
    air = shore.sim.surroundings.radio.air
    air.jammed = True
    start_us = shore.sim.now_us
    assert upload(shore, LOITER) not in (0, None)
    assert shore.sim.now_us - start_us < 2.5e6
    assert shore.sim.app.facade.plans.plan_id(PlanKind.MISSION) == 0
    assert any("not confirmed in time" in message.text for _, message in shore.of("STATUSTEXT"))
    air.jammed = False
    shore.run(15.0)
    assert shore.sim.app.facade.plans.plan_id(PlanKind.MISSION) != 0
    assert any("stored on the vessel" in message.text for _, message in shore.of("STATUSTEXT"))


def point(north):
    """An item so many ten metres north."""
    return (3, 16, 0, 1, 0.0, 0.0, 0.0, float("nan"), 411_852_000 + 900 * north, -87_060_000, 0.0)


def test_a_plan_that_was_cancelled_on_the_air_is_never_acknowledged_as_the_next_one(tmp_path):
    shore = Shore(tmp_path, persona="generic")
    shore.run(60.0)
    air = shore.sim.surroundings.radio.air
    air.jammed = True
    assert upload(shore, point(1), point(2), seconds=2.0) is None
    shore.send(dialect.MAVLink_mission_ack_message(1, 1, 15, 0))
    assert upload(shore, point(3), point(4), seconds=2.0) == 14, "refused at once"
    air.jammed = False
    shore.messages.clear()
    shore.run(15.0)
    assert not shore.of("MISSION_ACK")
    aboard = [item.x for item in shore.sim.app.facade.plans.items(PlanKind.MISSION)]
    assert aboard == [point(1)[8], point(2)[8]]
    texts = "".join(message.text for _, message in shore.of("STATUSTEXT"))
    assert "Plan now stored on the vessel" in texts
    assert upload(shore, point(3), point(4), seconds=20.0) == 0
    aboard = [item.x for item in shore.sim.app.facade.plans.items(PlanKind.MISSION)]
    assert aboard == [point(3)[8], point(4)[8]]


def test_a_plan_of_another_endpoint_waits_until_the_one_on_the_air_is_aboard(tmp_path):
    shore = Shore(tmp_path, persona="generic")
    near, far = pair("two")
    far.poll(0)
    ends = tuple(EndpointSettings(name=name, url=f"mem:{name}", persona="generic") for name in ("gcs", "two"))
    start(shore, tmp_path, others={"two": near}, endpoints=ends)
    shore.run(60.0)
    air = shore.sim.surroundings.radio.air
    air.jammed = True
    assert upload(shore, point(1), point(2), seconds=2.0) is None
    own, shore.far, shore.codec = shore.far, far, Codec(254, 190)
    assert upload(shore, point(3), point(4), seconds=2.0) == 14
    air.jammed, shore.far, shore.codec = False, own, Codec(255, 190)
    shore.run(15.0)
    assert shore.of("MISSION_ACK")[-1][1].type == 0
    aboard = [item.x for item in shore.sim.app.facade.plans.items(PlanKind.MISSION)]
    assert aboard == [point(1)[8], point(2)[8]]


def test_more_items_than_the_hour_can_hold_are_refused_before_the_first_is_asked_for(tmp_path):
    shore = Shore(tmp_path, "radio.profile=n-0.1", persona="generic")
    shore.run(60.0)
    shore.messages.clear()
    assert upload(shore, *[point(number) for number in range(800)], seconds=2.0) == 4, "no space"
    assert not shore.of("MISSION_REQUEST_INT")
    assert any("800 items" in message.text and "fit" in message.text for _, message in shore.of("STATUSTEXT"))
    shore = Shore(tmp_path, persona="generic")
    shore.run(60.0)
    assert upload(shore, *[point(number) for number in range(800)], seconds=120.0) == 0, "a straight line is short"


def test_signed_stations_only(tmp_path):
    shore = Shore(tmp_path)
    key = tmp_path / "signing.key"
    write_key(key, KEY)
    endpoint = EndpointSettings(name="gcs", url="mem:gcs", link_class="signed")
    start(shore, tmp_path, endpoints=(endpoint,), security=SecurityConfig(key_file=str(key)))
    shore.run(50.0)
    shore.send(ARM)
    shore.run(8.0)
    assert not shore.sim.snapshot.armed
    assert not shore.of("COMMAND_ACK")
    stamp = shore.gateway.gateway.keeper.state.timestamp + 1000
    shore.codec = Codec(255, 190, signer=Signer(SigningState(KEY, stamp), 3))
    shore.send(ARM)
    shore.run(8.0)
    assert shore.sim.snapshot.armed
    assert shore.of("COMMAND_ACK")[-1][1].get_signed()


def test_an_open_door_needs_a_decision(tmp_path):
    shore = Shore(tmp_path)
    with pytest.raises(ConfigError, match="can be reached by other machines"):
        start(shore, tmp_path, endpoints=(EndpointSettings(name="gcs", url="udp-listen://0.0.0.0:14550"),))
    with pytest.raises(ConfigError, match=r"needs security\.key_file"):
        start(shore, tmp_path, endpoints=(EndpointSettings(name="gcs", url="mem:gcs", link_class="signed"),))

"""The whole bridge beside the simulated vessel, in its time: what a console sees is what the truth is, and what a peer gets wrong is right.

Every packet that the bridge sends is read by our codec and by DUNE's own code.
"""

from __future__ import annotations

import math

import pytest

import config
from companion.imc.announcing import make_node, refresh
from companion.imc.compose import compose
from companion.imc.settings import ImcSettings
from companion.io.keeping import MemoryStore
from companion.settings.schema import load
from mavlink_bridge import imc
from mavlink_bridge.imc import Discovery, Header, Packet, Udp, encode
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.imc_node_rig import read_by_both

UTC_S = 1_790_000_000.0
ID = 0x2877


class Net:
    """The network between the bridge and its consoles. ``cut``: nothing gets through to the bridge."""

    udp_port, tcp_port, listen, is_local = 6002, 0, "127.0.0.1", True

    def __init__(self):
        self.inbox, self.sent, self.cut = [], [], False

    def poll(self, now_us):
        found, self.inbox = self.inbox, []
        return [] if self.cut else found

    def send(self, packets):
        self.sent += packets

    def addresses(self):
        return ["10.77.0.2"]

    def filenos(self):
        return []

    def close(self): ...


class Console:
    def __init__(self, voyage, imc_id=0x4001, host="10.77.0.1", ahead_s=0.0):
        self.voyage, self.imc_id, self.host, self.ahead_s = voyage, imc_id, host, ahead_s
        self.name, self.place, self.beats, self.request = f"ccu-{imc_id}", Udp(host, 6001), True, 0
        self.inbox = []

    def send(self, message, destination=ID):
        header = Header(self.imc_id, destination, UTC_S + self.voyage.now_s + self.ahead_s, 3)
        self.voyage.net.inbox.append((self.place, encode(Packet(header, message))))

    def announce(self):
        self.send(imc.Announce(sys_name=self.name, services=f"imc+udp://{self.host}:6001/"), 0)

    def ask(self, message, limit_s=10.0):
        """Send a request; the answers of its number, once the first is there."""
        self.request += 1
        asked = type(message)(**{**message.__dict__, "request_id": self.request})
        self.send(asked)
        end_s = self.voyage.now_s + limit_s
        while self.voyage.now_s < end_s:
            self.voyage.run(0.1)
            found = [
                m for _, m in self.inbox if type(m) is type(asked) and m.request_id == self.request and m.type != 3
            ]
            if found:
                return found
        raise AssertionError("no answer")

    def start(self, plan_id):
        return self.ask(imc.PlanControl(op=imc.PlanControlOp.START, plan_id=plan_id, flags=1))[0]

    def save(self, spec):
        return self.ask(imc.PlanDB(op=imc.PlanDBOp.SET, plan_id=spec.plan_id, arg=spec))[0]

    def newest(self, wanted):
        return next(message for _, message in reversed(self.inbox) if type(message) is wanted)


class Voyage:
    """World, bridge and consoles in one time."""

    def __init__(self, *overrides, **settings):
        self.world = World(load(config.path("sim.toml"), list(overrides), SimSettings), 1)
        self.settings = ImcSettings(store="", **settings)
        self.net = Net()
        node = make_node(self.settings, uid=5)
        refresh(node, self.net, 0, round(UTC_S * 1e6))
        self.bridge = compose(
            self.settings,
            node,
            self.net,
            lambda: round(UTC_S * 1e6) + self.world.now_us,
            link=self.world.ground("gcs"),
            store=MemoryStore(),
        )
        self.consoles = []
        self.poured = 0
        """Bytes sent to consoles, announcements included."""
        self._beat_us = 0
        self.deaf = False

    @property
    def now_s(self):
        return self.world.now_us * 1e-6

    @property
    def truth(self):
        return self.world.surroundings.truth

    def add(self, **more):
        console = Console(self, **more)
        self.consoles.append(console)
        console.announce()
        return console

    def run(self, seconds):
        end_us = self.world.now_us + round(seconds * 1e6)
        while self.world.now_us < end_us:
            if self.world.now_us >= self._beat_us:
                self._beat_us += 1_000_000
                for console in self.consoles:
                    if console.beats:
                        console.send(imc.Heartbeat())
            self.world.step()
            if not self.deaf:
                self.bridge.tick(self.world.now_us)
                self.world.pump(self.world.now_us)
                self.bridge.pump(self.world.now_us)
            self.deliver()

    def deliver(self):
        sent, self.net.sent = self.net.sent, []
        self.poured += sum(len(data) for _, data in sent)
        for place, data in sent:
            packet = read_by_both(data)
            for console in self.consoles:
                if isinstance(place, Discovery) or place == console.place:
                    console.inbox.append(((self.now_s, packet), packet.message))

    def at(self, north_m, east_m):
        lat_rad, lon_rad = self.world.surroundings.plant.frame.to_geodetic(north_m, east_m)
        return {"lat_rad": lat_rad, "lon_rad": lon_rad}


def goto_plan(voyage, name="p", *places):
    nodes = tuple(
        imc.PlanManeuver(f"G{number}", imc.Goto(**voyage.at(*place), z_units=imc.ZUnits.DEPTH, speed=1.2))
        for number, place in enumerate(places or ((30.0, 0.0), (80.0, 0.0)))
    )
    ways = tuple(imc.PlanTransition(f"G{n}", f"G{n + 1}", "ManeuverIsDone") for n in range(len(nodes) - 1))
    return imc.PlanSpecification(plan_id=name, start_man_id="G0", maneuvers=nodes, transitions=ways)


def test_the_console_sees_the_vessel_where_it_is_and_as_it_moves():
    voyage = Voyage()
    console = voyage.add()
    voyage.run(3.0)
    assert console.newest(imc.VehicleState).op_mode == imc.OpMode.SERVICE
    assert console.save(goto_plan(voyage)).type == imc.ReplyType.SUCCESS
    assert console.start("p").type == imc.ReplyType.SUCCESS
    errors_m, speeds = [], []
    for _ in range(15):
        voyage.run(1.0)
        state, truth = console.newest(imc.EstimatedState), voyage.truth
        north_m, east_m = voyage.world.surroundings.plant.frame.to_local(state.lat_rad, state.lon_rad)
        errors_m.append(math.dist((north_m, east_m), (truth.north_m, truth.east_m)))
        speeds.append(math.hypot(state.vx_mps, state.vy_mps))
    assert max(errors_m) < 1.2  # half a second at speed, and the receiver's own error
    assert 1.0 < max(speeds) < 1.5
    assert console.newest(imc.VehicleState).op_mode == imc.OpMode.MANEUVER
    assert console.newest(imc.PlanControlState).man_id in ("G0", "G1")
    path = console.newest(imc.PathControlState)
    assert abs(path.y_m) < 2.0
    assert {imc.SetThrusterActuation, imc.GpsFix, imc.Distance, imc.EntityState} <= {type(m) for _, m in console.inbox}


def test_a_tenth_of_what_the_peer_sends_at_rest_and_under_way():
    """The peer sends 8.3 kB/s to one console (imc-wire §3). The words of all parts and the log book are in this."""
    voyage = Voyage()
    console = voyage.add()
    voyage.run(4.0)
    for order in (lambda: None, lambda: console.start("p")):
        console.save(goto_plan(voyage))
        order()
        before, seconds = voyage.poured, 20.0
        voyage.run(seconds)
        assert (voyage.poured - before) / seconds <= 830.0


def test_a_plan_of_50_kb_comes_back_byte_for_byte():
    voyage = Voyage()
    console = voyage.add()
    voyage.run(2.0)
    places = [(20.0 + 0.1 * number, 5.0) for number in range(500)]
    spec = goto_plan(voyage, "long", *places)
    size = len(imc.fields_bytes(spec))
    assert 45_000 < size < 65_000
    console.ask(imc.PlanDB(op=imc.PlanDBOp.SET, plan_id="long", arg=spec))
    (reply,) = console.ask(imc.PlanDB(op=imc.PlanDBOp.GET, plan_id="long"))
    assert imc.fields_bytes(reply.arg) == imc.fields_bytes(spec)


def test_an_answer_goes_to_its_asker_and_state_to_both():
    voyage = Voyage()
    one, two = voyage.add(), voyage.add(imc_id=0x4002, host="10.77.0.7")
    voyage.run(2.0)
    one.save(goto_plan(voyage))
    assert not [m for _, m in two.inbox if isinstance(m, imc.PlanDB)]
    assert {imc.VehicleState, imc.EstimatedState} <= {type(m) for _, m in two.inbox}


def test_an_abort_stays_until_somebody_orders_otherwise():
    voyage = Voyage()
    console = voyage.add()
    voyage.run(2.0)
    console.save(goto_plan(voyage))
    console.start("p")
    voyage.run(5.0)
    console.send(imc.Abort())
    voyage.run(1.0)
    assert console.newest(imc.VehicleState).op_mode == imc.OpMode.ERROR
    voyage.run(10.0)  # the peer forgets it after one second
    assert console.newest(imc.VehicleState).op_mode == imc.OpMode.ERROR
    assert console.newest(imc.PlanControlState).state == imc.PlanState.BLOCKED
    assert abs(voyage.truth.u_mps) < 0.3


def test_sixteen_silent_seconds_of_the_network_and_all_is_back_within_two():
    voyage = Voyage()
    console = voyage.add()
    voyage.run(5.0)
    voyage.deaf = True
    voyage.run(16.0)
    voyage.deaf, back_s = False, voyage.now_s
    voyage.run(2.0)
    seen = {type(message) for (t_s, _), message in console.inbox if t_s >= back_s}
    assert {imc.Heartbeat, imc.VehicleState, imc.EstimatedState, imc.PlanControlState} <= seen


def test_a_vessel_that_falls_silent_is_not_shown_as_there_and_is_back_at_once():
    voyage = Voyage()
    console = voyage.add()
    voyage.run(3.0)
    link = voyage.bridge.link
    voyage.bridge.link = Dead(link)
    voyage.run(16.0)
    recent = {type(message) for (t_s, _), message in console.inbox if t_s > voyage.now_s - 8.0}
    assert imc.Heartbeat in recent
    assert not {imc.VehicleState, imc.EstimatedState, imc.GpsFix} & recent
    voyage.bridge.link, back_s = link, voyage.now_s
    voyage.run(2.0)
    seen = {type(message) for (t_s, _), message in console.inbox if t_s >= back_s}
    assert {imc.VehicleState, imc.EstimatedState} <= seen


class Dead:
    """A link on which nothing comes and into which nothing goes."""

    def __init__(self, link):
        self.link = link

    def poll(self, now_us):
        self.link.poll(now_us)
        return []

    def write(self, channel, data):
        return len(data)

    def close(self):
        self.link.close()


def test_a_console_whose_clock_is_a_minute_ahead_is_told_so_by_an_entity():
    voyage = Voyage()
    console = voyage.add(ahead_s=60.0)
    voyage.run(4.0)
    words = [m.description for _, m in console.inbox if isinstance(m, imc.EntityState)]
    assert any("60 s ahead" in text for text in words)
    assert any("60 s ahead" in m.text for _, m in console.inbox if isinstance(m, imc.LogBookEntry))


def test_read_only_shows_everything_and_obeys_nobody():
    voyage = Voyage(desk={"read_only": True})
    console = voyage.add()
    voyage.run(3.0)
    console.save(goto_plan(voyage))
    assert console.start("p").type == imc.ReplyType.FAILURE
    console.send(imc.Abort())
    voyage.run(5.0)
    assert not voyage.world.snapshot.armed
    assert {imc.VehicleState, imc.EstimatedState} <= {type(m) for _, m in console.inbox}


@pytest.mark.parametrize("destination", [0x0803, 0x2878, 0x4001])
def test_orders_for_another_system_move_nothing(destination):
    voyage = Voyage()
    console = voyage.add()
    voyage.run(2.0)
    spec = goto_plan(voyage)
    console.send(imc.PlanDB(op=imc.PlanDBOp.SET, plan_id="p", arg=spec, request_id=900), destination)
    console.send(imc.PlanControl(op=imc.PlanControlOp.START, plan_id="p", request_id=901), destination)
    voyage.run(3.0)
    assert not [m for _, m in console.inbox if isinstance(m, imc.PlanDB | imc.PlanControl)]
    assert not voyage.world.snapshot.armed

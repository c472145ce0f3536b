"""The QGC-like client over the radio, in virtual time: through the gateway at 651 bit/s, and plain on the shore modem's port."""

from __future__ import annotations

import pytest

import config
from companion.io.links.link import Received
from companion.io.links.mem import pair
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import PlanKind
from sitl.gateway import with_gateway
from sitl.world.settings import SimSettings
from tests.anew import RebootingWorld
from tests.gateways import gateway_beside
from tests.qgc_buttons import HOLD, Generation
from tests.qgc_client import NAN, QgcClient
from tests.transcript import Transcript

MEMORY = ('sensors=[{url="mem:nmea"}]', "actuators.url=mem:ard", "endpoints=[]", "radio.url=mem:radio")
X, Y = 411_852_000, -87_060_000
LOITER = [
    (0, 16, 0.0, 0.0, 0.0, 0.0, X, Y, 0.0),
    (2, 178, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
    (3, 19, 60.0, 0.0, 20.0, 0.0, X, Y, 0.0),
]
SURVEY = [LOITER[0], *[(3, 16, 0.0, 0.0, 0.0, NAN, X + 40 * n, Y + 3000 * (n % 2), 0.0) for n in range(40)]]


class Shore:
    """A station at a link's end; steps the world, and the gateway when there is one."""

    def __init__(self, settings, gateway_dir=None):
        self.client = QgcClient()
        if gateway_dir is None:
            self.sim, self.gateway = RebootingWorld(settings, 1), None
            self.link = self.sim.ground("shore")
            return
        settings = with_gateway(settings, gateway_dir)
        self.sim = RebootingWorld(settings, 1)
        near, self.link = pair("gcs")
        self.gateway = gateway_beside(self.sim, gateway_dir, near, seed=2)
        self.link.poll(0)

    @property
    def air(self):
        return self.sim.surroundings.radio.air

    def turn(self):
        self.sim.step()
        now_us = self.sim.now_us
        if self.gateway is not None:
            self.gateway.tick(now_us)
        for _ in range(40):
            if not self.talk(now_us):
                break

    def talk(self, now_us):
        """Between two ticks a local station and the gateway exchange as much as they like."""
        if self.gateway is not None:
            self.gateway.pump(now_us)
        heard = [event.data for event in self.link.poll(now_us) if isinstance(event, Received)]
        for data in heard:
            self.client.receive(data, now_us)
        said = self.client.take(now_us)
        if said:
            self.link.write(0, said)
        return bool(heard or said)

    def run(self, script=None, limit_s=120.0):
        if script is not None:
            self.client.start(script)
        end_us = self.sim.now_us + limit_s * 1e6
        while self.sim.now_us < end_us:
            self.turn()
            if self.client.idle:
                return self.client.result
        raise AssertionError(f"no end: {self.client.report}")

    def wait(self, seconds):
        end_us = self.sim.now_us + seconds * 1e6
        while self.sim.now_us < end_us:
            self.turn()


def press(shore, command, *params, tries=1):
    """What an operator does with a button that brought no answer."""
    for _ in range(tries):
        result = shore.run(shore.client.command(command, *params))
        if result is not None:
            return result
    return None


def sail(shore, tries=1):
    assert press(shore, 400, 1.0, tries=tries) == 0
    assert press(shore, 300, 0.0, 0.0, tries=tries) == 0
    shore.wait(60.0)
    assert shore.sim.snapshot.mode is Mode.AUTO
    assert shore.sim.snapshot.path.on_path


def test_through_the_gateway(tmp_path):
    shore = Shore(load(config.path("sim.toml"), [*MEMORY, "radio.profile=o-10"], SimSettings), tmp_path)
    shore.run()
    report = shore.client.report
    assert report.failures == []
    assert report.finished_s < 1.0
    shore.wait(40.0)
    start_us, log = shore.sim.now_us, shore.air.log
    assert shore.run(shore.client.upload(0, LOITER)) == 0
    took_s = (shore.sim.now_us - start_us) * 1e-6
    sizes = [len(item.data) for item in log if item.start_us >= start_us and item.data[0] >> 4 in (5, 7, 9)]
    print(f"confirmed in {took_s:.2f} s, {sum(sizes)} bytes")
    assert sum(sizes) <= 35
    assert took_s <= 1.5
    assert shore.sim.app.facade.plans.plan_id(PlanKind.MISSION) != 0
    sail(shore)


@pytest.mark.parametrize("generation", [Generation.V4, Generation.V5], ids=lambda item: item.value)
def test_what_the_vessel_has_accepted_is_shown_at_once(tmp_path, generation):
    """QGroundControl's own windows: 1.3 s for a mode to show, three times, 1.5 s for the armed bit, 1.5 s for each part of a plan.

    An order that has to wait for a state on the air is answered after up to 1.7 s: then QGroundControl says that it waits, or that it
    got no answer yet. What it must never say is that something failed which the boat does. (Other phases of the vessel's rhythm:
    test_radio_operator.py.)
    """
    shore = Shore(load(config.path("sim.toml"), [*MEMORY, "radio.profile=o-10"], SimSettings), tmp_path)
    client = shore.client
    client.generation = generation
    told = Transcript(client)
    shore.run()
    shore.wait(40.0)
    told.seen("connects")
    assert shore.run(client.upload_plan(LOITER))
    told.seen("*Upload*: plan, empty fence and rally points")
    start_us = shore.sim.now_us
    assert shore.run(client.start_mission())
    while shore.sim.snapshot.mode is not Mode.AUTO and shore.sim.now_us < start_us + 20e6:
        shore.turn()
    assert shore.sim.now_us - start_us <= 5_000_000, "slider to sailing"
    shore.wait(3.0)
    told.seen("slider *Start Mission*")
    shore.run(client.mode_menu(HOLD))
    assert shore.sim.snapshot.mode is Mode.HOLD
    shore.wait(2.0)
    told.seen("mode menu → *Hold*")
    assert shore.run(client.continue_mission())
    shore.wait(1.0)
    told.seen("slider *Continue Mission*")
    shore.run(client.go_to(X + 500, Y))
    shore.wait(2.0)
    told.seen("map → *Go to location*")
    assert shore.run(client.return_home())
    told.seen("*Return*")
    shore.run(client.disarm())
    shore.wait(0.5)
    told.seen("*Disarm*")
    assert not shore.sim.snapshot.armed
    shore.run(client.reboot())
    shore.run()
    shore.wait(30.0)
    told.seen("*Reboot Vehicle*")
    assert shore.sim.starts == 2
    assert len(client.report.plans[0]) == 3, "the plan was kept"
    told.holds(f"radio {generation.value}")
    assert client.report.popups == []


def test_the_first_picture_is_whole_within_ten_seconds(tmp_path):
    shore = Shore(load(config.path("sim.toml"), [*MEMORY, "radio.profile=o-10"], SimSettings), tmp_path)
    shore.wait(10.0)
    seen = shore.gateway.twin.snapshot(shore.sim.now_us, 1)
    assert seen is not None
    assert seen.health.prearm_ok == shore.sim.snapshot.health.prearm_ok
    assert seen.fix.satellites is not None
    assert seen.home_lat_rad == pytest.approx(shore.sim.snapshot.home_lat_rad, abs=1e-8)


def test_a_long_upload_is_held_open_until_the_vessel_has_it(tmp_path):
    shore = Shore(load(config.path("sim.toml"), [*MEMORY, "radio.profile=o-10"], SimSettings), tmp_path)
    shore.run()
    shore.wait(40.0)
    assert shore.run(shore.client.upload(0, SURVEY)) == 0
    assert len(shore.sim.app.facade.plans.items(PlanKind.MISSION)) == 40


def test_an_upload_that_never_arrives_ends_as_an_error(tmp_path):
    shore = Shore(load(config.path("sim.toml"), [*MEMORY, "radio.profile=o-10"], SimSettings), tmp_path)
    shore.run()
    shore.wait(40.0)
    shore.air.jammed = True
    assert shore.run(shore.client.upload(0, LOITER)) not in (0, None)
    assert shore.sim.app.facade.plans.plan_id(PlanKind.MISSION) == 0


def test_plain_on_the_shore_modems_port():
    shore = Shore(load(config.path("sim.toml"), MEMORY, SimSettings))
    shore.client.then(shore.client.upload(0, LOITER))
    for _ in range(4000):
        shore.turn()
        if shore.sim.app.facade.plans.plan_id(PlanKind.MISSION):
            break
    assert shore.sim.app.facade.plans.plan_id(PlanKind.MISSION), f"never uploaded: {shore.client.report}"
    shore.run()
    sail(shore, tries=6)

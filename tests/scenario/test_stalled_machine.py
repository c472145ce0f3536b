"""A machine that stands still for seconds while it simulates: the vessel's time falls behind the clock, and the radio goes on."""

from __future__ import annotations

from companion.io.links import Received
from sitl.gateway import WithGateway
from tests.ashore import Ashore
from tests.world_station import GCS_HEARTBEAT

ARM, ACCEPTED, IN_PROGRESS = 400, 0, 5
PERIOD_US = 50_000


class Paced(Ashore):
    """Driven by a clock, as ``companion sim --gateway`` is."""

    clock_us = 0

    def step(self) -> None:
        if not hasattr(self, "both"):
            self.both = WithGateway(self.world, self.gateway, lambda: self.world.now_us)
        self.clock_us += PERIOD_US
        if self.clock_us % 1_000_000 == 0:
            self.link.write(0, self.operator.codec.encode(GCS_HEARTBEAT))
        self.both.tick(self.clock_us)
        for event in self.link.poll(self.world.now_us):
            if isinstance(event, Received):
                self.operator.receive(event.data, self.world.now_us)


def test_the_radio_goes_on_when_the_machine_stood_still(tmp_path):
    shore = Paced(tmp_path)
    shore.run(30.0)
    for stall_us in (1_600_000, 3_000_000, 5_000_000):
        shore.clock_us += stall_us
        shore.run(10.0)
    assert shore.clock_us - shore.world.now_us > 5_000_000, "the vessel's time fell behind"
    shore.give(ARM, 1.0)
    assert shore.until(lambda: shore.world.snapshot.armed, 3.0)
    shore.run(1.0)
    answers = [message.result for message in shore.operator.all("COMMAND_ACK") if message.command == ARM]
    assert answers[-1] == ACCEPTED
    assert not [text for text in shore.texts() if "nothing from the vessel" in text]

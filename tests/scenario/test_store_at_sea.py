"""A store that cannot be written bars the departure, never the way back; what differs from the file is told to every station."""

from __future__ import annotations

import config as shipped
from companion.io.keeping.content import Completion, SavePlan, SaveRecord, StoreContent
from companion.io.keeping.mark import ASIDE, WorldKind
from companion.io.keeping.store import MemoryStore, Store
from companion.settings.schema import load
from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, Result, SetParameter
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.world.settings import SimSettings
from sitl.world.world import World

WHY = "no space on the disk"


class Failing(MemoryStore):
    """A store whose disk fails when a test says so."""

    trouble = ""
    memory_ok = False
    _told = ""

    def completions(self):
        done = super().completions()
        if self.trouble:
            text = f"kept in memory only: {self.trouble}" if self.memory_ok else self.trouble
            done = [Completion(each.ticket, self.memory_ok, text) for each in done]
        if self.trouble != self._told:
            self._told = self.trouble
            done.append(Completion(0, not self.trouble, self.trouble))
        return done


class Boat:
    """A world with nobody but its own people, the texts and answers of its vessel."""

    def __init__(self, store, *overrides):
        settings = load(shipped.path("sim.toml"), ["operator.gcs_required=false", *overrides], SimSettings)
        self.world, self.texts, self.replies = World(settings, 3, store=store), [], []
        self.run(4.0)

    def run(self, seconds):
        for _ in range(round(seconds * 20)):
            self.world.step()
            self.texts += [text.text for text in self.world.snapshot.texts]

    def ask(self, body):
        self.world.app.submit(body, self.replies.append)
        self.run(0.3)
        return self.replies[-1]


def test_a_store_that_cannot_be_written_bars_the_departure_with_the_mend():
    store = Failing()
    store.trouble = WHY
    boat = Boat(store)
    refused = boat.ask(Arm(True))
    assert refused.result is Result.REJECTED_NOW
    assert refused.reason == f"store: {WHY}; mend it, or arm by force"
    assert boat.ask(SetParameter("DEPTH_MIN", 2.0)).reason == f"not stored: {WHY}"
    assert boat.world.app.settings.depth.min_altitude_m == 4.0
    store.trouble = ""
    boat.run(0.2)
    assert boat.ask(Arm(True)).result is Result.ACCEPTED


def test_it_is_told_while_it_lasts_and_when_it_is_over():
    store = Failing()
    store.trouble = WHY
    boat = Boat(store)
    boat.run(130.0)
    told = [text for text in boat.texts if text.startswith(f"Store: {WHY}")]
    assert len(told) == 3, "at the start and once a minute"
    store.trouble = ""
    boat.run(1.0)
    assert "Store: can be written again" in boat.texts


def test_who_insists_may_depart():
    store = Failing()
    store.trouble = WHY
    assert Boat(store).ask(Arm(True, force=True)).result is Result.ACCEPTED


def test_what_fails_under_way_never_bars_the_way_back():
    store = Failing()
    boat = Boat(store)
    assert boat.ask(Arm(True)).result is Result.ACCEPTED
    store.trouble = WHY
    boat.run(2.0)
    assert boat.world.snapshot.armed
    assert boat.ask(Arm(False)).result is Result.ACCEPTED
    assert boat.ask(Arm(True)).result is Result.ACCEPTED


def test_an_owner_who_accepts_memory_departs_and_each_change_is_marked():
    store = Failing()
    store.trouble, store.memory_ok = WHY, True
    boat = Boat(store, "operator.store_required=false")
    assert boat.ask(Arm(True)).result is Result.ACCEPTED
    assert boat.ask(SetParameter("DEPTH_MIN", 2.0)).result is Result.ACCEPTED
    assert boat.world.app.settings.depth.min_altitude_m == 2.0
    assert f"Taken over, but kept in memory only: {WHY}" in boat.texts


def test_a_store_that_was_set_aside_bars_the_departure_until_somebody_has_decided():
    store = MemoryStore()
    store.submit(SaveRecord(ASIDE, 1, "companion.db.simulated-1"))
    store.completions()
    refused = Boat(store).ask(Arm(True))
    assert "companion.db.simulated-1" in refused.reason
    assert "companion store adopt" in refused.reason


def test_every_station_that_comes_is_told_what_the_store_changed():
    boat = Boat(MemoryStore(StoreContent(params={"DEPTH_MIN": 0.5, "CRUISE_SPEED": 1.5, "FS_GCS_TIMEOUT": 45.0})))
    lines = [text for text in boat.texts if "from the store" in text]
    assert lines == ["DEPTH_MIN = 0.5 from the store (file: 4)", "FS_GCS_TIMEOUT = 45 from the store (file: 5)"]
    late, deframer, codec = boat.world.ground("tcp"), Deframer(), Codec(255, 190)
    late.write(0, codec.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)))
    boat.run(2.0)
    heard = b"".join(getattr(event, "data", b"") for event in late.poll(boat.world.now_us))
    said = [decode(frame) for frame in deframer.receive(heard, 0)]
    texts = "".join(str(item.text) for item in said if item is not None and item.get_type() == "STATUSTEXT")
    assert lines[0] in texts
    assert lines[1] in texts


class Busy(MemoryStore):
    """A store whose writer takes nothing more while a test says so."""

    busy = False

    def completions(self):
        if not self.busy:
            return super().completions()
        refused, self._waiting = self._waiting, []
        return [Completion(ticket, False, "the store is busy") for ticket, _ in refused]


def test_a_voyage_that_a_busy_store_would_not_take_is_stored_when_it_does():
    """It counted as stored: after a restart offshore the boat knew neither that it was under way nor its home."""
    boat = Boat(store := Busy())
    boat.world.app.keep_voyage()
    store.busy = True
    boat.ask(Arm(arm=True))
    boat.world.run(0.5)
    assert "voyage" not in store.snapshot().records
    store.busy = False
    boat.world.run(2.0)
    assert "voyage" in store.snapshot().records


FENCE = (PlanItem(5003, 0, 200.0, 0.0, 0.0, 0.0, 411850000, -87062000, 0.0, True),)


def test_a_fence_lost_from_the_store_bars_the_departure_until_it_is_loaded_again_or_cleared(tmp_path):
    """It was an INFO among others, and the boat sailed out of the fence that had held her."""
    path = tmp_path / "companion.db"
    store = Store(path, world=WorldKind.SIMULATED)
    store.submit(SavePlan(PlanKind.FENCE, FENCE))
    store.close()
    data = bytearray(path.read_bytes())
    data[data.index(b"411850000")] ^= 1
    path.write_bytes(data)
    damaged = Store(path, world=WorldKind.SIMULATED)
    damaged.close()
    store = MemoryStore(damaged.snapshot())
    store.warnings = damaged.warnings
    boat = Boat(store)
    assert [severity for severity, text in boat.world.snapshot.standing if text in store.warnings] == [Severity.WARNING]
    refused = boat.ask(Arm(True)).reason
    assert "fence is damaged and lost: load it again, or clear it" in refused
    assert boat.ask(LoadPlan(PlanKind.FENCE, ())).result is Result.ACCEPTED
    assert boat.ask(Arm(True)).result is Result.ACCEPTED

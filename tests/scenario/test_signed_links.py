"""The attack list against the whole vessel on signed links: nothing gets in, the genuine station is not disturbed."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as library

import config
from companion import security
from companion.io.keeping.keys import write_key
from companion.io.keeping.store import MemoryStore
from companion.settings.schema import ConfigError, load
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState, units_from_utc
from sitl.world.settings import SimSettings
from sitl.world.world import World

KEY = bytes(range(32))
ARM_BY_FORCE = dialect.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0)
DISARM_BY_FORCE = dialect.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0)
HEARTBEAT = dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def settings(tmp_path: Path, *changes: str) -> SimSettings:
    key = tmp_path / "signing.key"
    if not key.exists():
        write_key(key, KEY)
    found = load(config.path("sim.toml"), [f"security.key_file={key}", *changes], SimSettings)
    signed = tuple(item.model_copy(update={"link_class": "signed"}) for item in found.endpoints)
    return found.model_copy(update={"endpoints": signed})


class Station:
    """A ground station; ``key`` None sends unsigned."""

    def __init__(self, world: World, link: str, key: bytes | None = KEY, stamp: int = 0) -> None:
        self.world, self.link = world, world.ground(link)
        now = units_from_utc((world.snapshot.utc_us if world.snapshot else 0) or 0)
        self.clock = SigningState(key, stamp or now + 1_000)
        self.codec = Codec(255, 190, signer=Signer(self.clock, 9) if key else None)
        self.deframer = Deframer()
        self.acks: list[object] = []
        self.texts: list[str] = []

    def send(self, message: object) -> bytes:
        raw = self.codec.encode(message)
        self.link.write(0, raw)
        return raw

    def tick(self, count: int = 5) -> None:
        for _ in range(count):
            self.world.step()
            for event in self.link.poll(self.world.now_us):
                for frame in self.deframer.receive(getattr(event, "data", b""), self.world.now_us):
                    message = decode(frame)
                    if message is not None and message.get_type() == "COMMAND_ACK":
                        self.acks.append(message)
                    elif message is not None and message.get_type() == "STATUSTEXT":
                        self.texts.append(message.text)


@pytest.fixture
def world(tmp_path: Path) -> World:
    world = World(settings(tmp_path), seed=3)
    for _ in range(100):
        world.step()
    return world


def started(tmp_path: Path, store: MemoryStore | None = None) -> tuple[World, MemoryStore]:
    kept = store or MemoryStore()
    world = World(settings(tmp_path), seed=3, store=kept)
    world.run(5.0)
    return world, kept


def armed(world: World) -> bool:
    assert world.snapshot is not None
    return world.snapshot.armed


def order(station: Station, message: object) -> bytes:
    """A genuine order that must be answered."""
    before = len(station.acks)
    station.send(HEARTBEAT)
    raw = station.send(message)
    station.tick()
    assert len(station.acks) == before + 1
    return raw


def test_the_attack_list_moves_nothing_and_the_genuine_station_is_served(world: World) -> None:
    genuine = Station(world, "gcs")
    captured = order(genuine, ARM_BY_FORCE)
    assert armed(world)
    order(genuine, DISARM_BY_FORCE)
    assert not armed(world)
    thief = {"gcs": Station(world, "gcs", key=b"\xee" * 32), "sdk": Station(world, "sdk", key=b"\xee" * 32)}
    future = Station(world, "gcs", key=b"\xee" * 32, stamp=(1 << 48) - 1_000)
    unsigned = Station(world, "gcs", key=None)
    mav = library.MAVLink(None, 255, 190)
    downgraded = library.MAVLink_command_long_message(1, 1, 400, 0, 1, 21196, 0, 0, 0, 0, 0).pack(
        mav, force_mavlink1=True
    )
    attacks = {
        "forged": lambda: thief["gcs"].send(ARM_BY_FORCE),
        "replayed": lambda: genuine.link.write(0, captured),
        "replayed on another link": lambda: thief["sdk"].link.write(0, captured),
        "forged on another link": lambda: thief["sdk"].send(ARM_BY_FORCE),
        "future-dated": lambda: future.send(ARM_BY_FORCE),
        "unsigned": lambda: unsigned.send(ARM_BY_FORCE),
        "MAVLink 1": lambda: genuine.link.write(0, downgraded),
        "stripped of its signature": lambda: genuine.link.write(0, captured[:-13]),
    }
    for name, attack in attacks.items():
        for _ in range(5):
            attack()
            genuine.tick(30)
            assert not armed(world), name
        order(genuine, dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    order(genuine, ARM_BY_FORCE)
    assert armed(world)


def test_captured_orders_stay_refused_after_a_restart(tmp_path: Path) -> None:
    store = MemoryStore()
    first = World(settings(tmp_path), seed=3, store=store)
    for _ in range(100):
        first.step()
    genuine = Station(first, "gcs")
    captured = order(genuine, ARM_BY_FORCE)
    order(genuine, DISARM_BY_FORCE)
    for _ in range(20 * 61):  # the stamps are saved every minute
        first.step()
    second = World(settings(tmp_path), seed=3, store=store)
    link = second.ground("gcs")
    for _ in range(10):
        link.write(0, captured)
        for _ in range(30):
            second.step()
        assert not armed(second)


@pytest.mark.parametrize("orderly", [True, False])
@pytest.mark.parametrize("run_s", [2.0, 9.9, 33.0])
def test_nothing_captured_is_good_after_a_restart_however_fresh(tmp_path: Path, orderly: bool, run_s: float) -> None:
    """Power is lost, or the process ends, at any time after the last save; one station's clock leaps ahead before."""
    first, store = started(tmp_path)
    genuine = Station(first, "gcs")
    captured = [order(genuine, ARM_BY_FORCE)]
    genuine.tick(round(run_s * 20))
    captured += [order(genuine, message) for message in (DISARM_BY_FORCE, ARM_BY_FORCE)]
    ahead = Station(first, "gcs", stamp=first.app.keeper.state.timestamp + 3600 * security.UNITS_PER_S)
    captured += [order(ahead, message) for message in (DISARM_BY_FORCE, ARM_BY_FORCE)]
    assert armed(first)
    if orderly:
        first.app.shutdown(first.now_us)
    second, _ = started(tmp_path, store)
    link = second.ground("gcs")
    for wait_s in (0.0, 1.0, 12.0, 70.0):
        second.run(wait_s)
        for raw in captured:
            link.write(0, raw)
            second.run(0.2)
            assert not armed(second)


def test_after_an_orderly_restart_a_station_with_a_right_clock_gets_through_at_once(tmp_path: Path) -> None:
    first, store = started(tmp_path)
    genuine = Station(first, "gcs")
    order(genuine, ARM_BY_FORCE)
    genuine.tick(100)
    first.app.shutdown(first.now_us)
    second, _ = started(tmp_path, store)
    order(Station(second, "gcs", stamp=genuine.clock.timestamp + 6 * security.UNITS_PER_S), ARM_BY_FORCE)
    assert armed(second)


def test_after_a_loss_of_power_a_station_that_heard_us_gets_through_at_once_and_any_other_in_eleven_seconds(
    tmp_path: Path,
) -> None:
    first, store = started(tmp_path)
    order(Station(first, "gcs"), ARM_BY_FORCE)
    first.run(15.0)
    lost = first.app.keeper.state.timestamp
    second, _ = started(tmp_path, copy.deepcopy(store))
    listening = Station(second, "gcs", stamp=second.app.keeper.state.timestamp)
    order(listening, ARM_BY_FORCE)
    assert armed(second)
    third, _ = started(tmp_path, store)
    order(Station(third, "sdk", stamp=lost + 11 * security.UNITS_PER_S), ARM_BY_FORCE)
    assert armed(third)


def blank(tmp_path: Path, store: MemoryStore | None = None) -> World:
    """A vessel whose computer has no clock, before GNSS tells the time. Its store knows no stamps, unless one is given."""
    world = World(settings(tmp_path), seed=3, store=store or MemoryStore())
    world.surroundings.plant.sensors.faults.utc_blank = True
    world.run(5.0)
    return world


def time_comes(world: World) -> int:
    """GNSS tells the time; return it as a stamp."""
    world.surroundings.plant.sensors.faults.utc_blank = False
    world.run(2.0)
    assert world.snapshot is not None
    assert world.snapshot.utc_us is not None
    return units_from_utc(world.snapshot.utc_us)


SIM_START = units_from_utc(1_767_225_600_000_000)
"""2026-01-01, when simulations begin."""
WEEK, MINUTE = 7 * 86_400 * security.UNITS_PER_S, 60 * security.UNITS_PER_S


@pytest.mark.parametrize("begun_armed", [False, True], ids=["disarmed", "armed"])
@pytest.mark.parametrize("genuine_first", [False, True])
def test_what_was_recorded_last_week_is_worth_nothing_once_the_time_is_known(
    tmp_path: Path, genuine_first: bool, begun_armed: bool
) -> None:
    """Replayed before GNSS told the time it opened a stream, and that one stayed good: a recorded order armed the boat."""
    world = blank(tmp_path)
    thief = Station(world, "gcs", stamp=SIM_START - WEEK)
    thief.codec = Codec(
        255, 190, signer=Signer(thief.clock, 7)
    )  # a stream of last week's, not of the station that is here
    order(thief, ARM_BY_FORCE if begun_armed else DISARM_BY_FORCE)
    if genuine_first:  # its frames move the vessel's stamp to the right time before GNSS does
        genuine = Station(world, "sdk", stamp=SIM_START + 30 * security.UNITS_PER_S)
        order(genuine, dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    time_comes(world)
    if begun_armed:
        order(Station(world, "gcs", stamp=world.app.keeper.state.timestamp), DISARM_BY_FORCE)
    thief.acks.clear()
    for _ in range(3):
        thief.send(HEARTBEAT)
        thief.send(ARM_BY_FORCE)
        thief.tick(10)
        assert not armed(world)
    assert thief.acks == []


def test_who_was_let_in_by_a_recorded_frame_hears_no_position_once_the_time_is_known(tmp_path: Path) -> None:
    world = blank(tmp_path)
    thief = Station(world, "gcs", stamp=SIM_START - WEEK)
    thief.send(HEARTBEAT)
    thief.tick(60)
    assert kinds(thief, 60) > {"HEARTBEAT", "GLOBAL_POSITION_INT"}
    time_comes(world)
    kinds(thief, 20)
    assert kinds(thief, 100) == {"HEARTBEAT"}


def kinds(station: Station, ticks: int) -> set[str]:
    """Names of what a station hears."""
    found = set()
    for _ in range(ticks):
        station.world.step()
        for event in station.link.poll(station.world.now_us):
            for frame in station.deframer.receive(getattr(event, "data", b""), station.world.now_us):
                message = decode(frame)
                found |= {message.get_type()} if message is not None else set()
    return found


@pytest.mark.parametrize("behind_s", [0, 50], ids=["right", "right to a minute"])
def test_a_station_with_a_clock_right_to_a_minute_stays_heard_when_the_time_comes(
    tmp_path: Path, behind_s: int
) -> None:
    world = blank(tmp_path)
    genuine = Station(world, "gcs", stamp=SIM_START - behind_s * security.UNITS_PER_S)
    order(genuine, ARM_BY_FORCE)
    order(genuine, DISARM_BY_FORCE)
    genuine.clock.timestamp = max(genuine.clock.timestamp, time_comes(world) - behind_s * security.UNITS_PER_S)
    order(genuine, ARM_BY_FORCE)
    assert armed(world)


def test_a_station_that_is_an_hour_behind_takes_the_vessels_stamp_and_stays_heard(tmp_path: Path) -> None:
    world = blank(tmp_path)
    genuine = Station(world, "gcs", stamp=SIM_START - 60 * MINUTE)
    order(genuine, DISARM_BY_FORCE)
    time_comes(world)
    genuine.clock.timestamp = world.app.keeper.state.timestamp  # as MAVLink libraries do with each frame they hear
    order(genuine, ARM_BY_FORCE)
    assert armed(world)


def test_a_store_that_remembers_lets_nobody_be_put_out_by_a_time_of_which_it_knew(tmp_path: Path) -> None:
    """The clock of a station that goes by itself may be an hour behind while the vessel's own time is right: nothing changes."""
    first, store = started(tmp_path)
    slow = Station(first, "gcs")
    order(slow, DISARM_BY_FORCE)
    first.run(30.0)
    first.app.shutdown(first.now_us)
    floor = first.app.keeper.state.floor
    second = World(settings(tmp_path), seed=3, store=store)
    second.run(5.0)
    assert second.app.keeper.state.floor == floor


DAY_US = 86_400_000_000
CLOCK_US = 1_790_000_000_000_000
"""A right clock of the computer, as it starts."""


@pytest.mark.parametrize(
    ("clock_us", "ahead_days", "is_armed", "taken"),
    [
        (CLOCK_US, 3 * 365, False, False),
        (CLOCK_US, 3 * 365, True, False),
        (CLOCK_US, 200, True, False),
        (CLOCK_US, 200, False, True),
        (0, 3 * 365, False, True),
        (0, 3 * 365, True, True),
    ],
)
def test_a_forged_gnss_time_puts_nobody_out_for_years_where_the_computer_has_a_clock(
    tmp_path: Path, world: World, clock_us: int, ahead_days: int, is_armed: bool, taken: bool
) -> None:
    """Also with a new store. Without a clock GNSS is the only one who tells the time, whatever it is."""
    keeper = security.Keeper(settings(tmp_path), MemoryStore(), lambda *text: None, clock_us)
    keeper.tick(0, None)
    told_us = CLOCK_US + ahead_days * DAY_US
    assert keeper.tick(50_000, replace(world.snapshot, armed=is_armed, utc_us=told_us)) is taken
    assert (keeper.state.floor > units_from_utc(CLOCK_US)) is taken


def test_an_old_key_hands_over_to_a_new_one_and_is_then_worth_nothing(tmp_path: Path) -> None:
    world, _ = started(tmp_path, MemoryStore())  # as on a boat: a simulation's store would leave the key file alone
    new = bytes(range(100, 132))
    genuine = Station(world, "gcs")
    order(genuine, dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    genuine.send(dialect.MAVLink_setup_signing_message(1, 1, list(new), 0))
    genuine.tick(10)
    assert Path(world.settings.security.key_file).read_bytes() == new
    genuine.send(ARM_BY_FORCE)
    genuine.tick(30)
    assert not armed(world)
    stamp = world.app.keeper.state.timestamp + 10_000
    order(Station(world, "gcs", key=new, stamp=stamp), ARM_BY_FORCE)
    assert armed(world)


def test_a_stranger_cannot_set_a_key(world: World) -> None:
    for station in (Station(world, "gcs", key=None), Station(world, "gcs", key=b"\x01" * 32)):
        station.send(dialect.MAVLink_setup_signing_message(1, 1, list(b"\x01" * 32), 0))
        station.tick(10)
    assert Path(world.settings.security.key_file).read_bytes() == KEY


def test_a_key_of_zeros_is_refused_with_the_reason(world: World) -> None:
    """MAVProxy's 'signing remove' sends one; whoever knew that could then give orders."""
    genuine = Station(world, "gcs")
    order(genuine, dialect.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    genuine.send(dialect.MAVLink_setup_signing_message(1, 1, [0] * 32, 0))
    genuine.tick(20)
    assert Path(world.settings.security.key_file).read_bytes() == KEY
    assert any("zeros" in text for text in genuine.texts)
    stranger = Station(world, "gcs", key=bytes(32), stamp=world.app.keeper.state.timestamp + 10)
    stranger.send(HEARTBEAT)
    stranger.send(ARM_BY_FORCE)
    stranger.tick(20)
    assert not armed(world)


@pytest.mark.parametrize(
    ("url", "local"),
    [
        ("udp://127.0.0.1:14550", True),
        ("udp://localhost:14550", True),
        ("tcp-listen://[::1]:5760", True),
        ("/dev/ttyUSB0", True),
        ("pty:/tmp/x", True),
        ("udp://192.168.1.7:14550", False),
        ("tcp-listen://:5760", False),
        ("tcp-listen://0.0.0.0:5760", False),
        ("udp-listen://:14550", False),
        ("udp-broadcast://192.168.1.255:14550", False),
        ("udp://ground.local:14550", False),
    ],
)
def test_which_links_others_can_reach(url: str, local: bool) -> None:
    assert security.is_local(url) is local


def one_endpoint(tmp_path: Path, extra: str, key: str = "") -> SimSettings:
    text = f'[security]\nkey_file = "{key}"\n[[endpoints]]\nname = "gcs"\nurl = "udp://192.168.1.7:14550"\n{extra}\n'
    file = tmp_path / "vessel.toml"
    file.write_text(text)
    return load(file, [], SimSettings)


def test_an_open_door_needs_a_decision(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as refused:
        World(one_endpoint(tmp_path, ""), seed=1)
    assert "insecure = true" in refused.value.mistakes[0]
    for extra in ('link_class = "telemetry"', "insecure = true"):
        assert security.mistakes(one_endpoint(tmp_path, extra)) == []
    assert "needs security.key_file" in security.mistakes(one_endpoint(tmp_path, 'link_class = "signed"'))[0]
    world = World(one_endpoint(tmp_path, "insecure = true"), seed=1)
    world.run(1.0)
    assert security.open_doors(world.settings) == ["gcs"]


@pytest.mark.parametrize("fault", ["missing", "short", "readable"])
def test_a_key_that_cannot_be_used_stops_the_start_with_the_reason(tmp_path: Path, fault: str) -> None:
    key = tmp_path / "signing.key"
    if fault == "short":
        key.write_bytes(KEY[:31])
        key.chmod(0o600)
    elif fault == "readable":
        write_key(key, KEY)
        key.chmod(0o644)
    found = one_endpoint(tmp_path, 'link_class = "signed"', str(key))
    with pytest.raises(ConfigError) as refused:
        World(found, seed=1)
    word = {"missing": "companion keys make", "short": "31 bytes", "readable": "chmod 600"}[fault]
    assert word in refused.value.mistakes[0]

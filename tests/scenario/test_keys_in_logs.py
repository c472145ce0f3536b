"""A run tells no key: not one that a station sets over a link, not the one that signs. It replays without any, and says so."""

from __future__ import annotations

import os
import random
import stat
from pathlib import Path

import pytest

import config
from companion.io.log_file import parts_of
from companion.io.recording.key_blanker import KeyBlanker, blank_frame
from companion.replay import replay, summary
from companion.settings import load
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState
from sitl.gateway import shore_gateway, with_gateway
from sitl.world import World
from sitl.world.settings import SimSettings
from tests.scenario.test_signed_links import ARM_BY_FORCE, DISARM_BY_FORCE, KEY, Station, order, settings

NEW = bytes(range(100, 132))


def files_of(run_dir: Path) -> list[Path]:
    return [path for path in run_dir.rglob("*") if path.is_file()]


def tells(path: Path, key: bytes) -> bool:
    """Whether a quarter of a key, anywhere in it, stands in a file, as bytes, hex or numbers of a list."""
    data = path.read_bytes()
    for at in range(0, 25):
        part = key[at : at + 8]
        words = (part, part.hex().encode(), part.hex().upper().encode(), ", ".join(map(str, part)).encode())
        if any(word in data for word in words):
            return True
    return False


@pytest.fixture
def sailed(tmp_path: Path) -> tuple[World, Path]:
    """A run in which a station changes the key, in one piece and in three, and goes on with the new one."""
    run_dir = tmp_path / "run"
    world = World(settings(tmp_path, "record.enabled=true"), seed=3, run_dir=run_dir)
    world.run(5.0)
    genuine = Station(world, "gcs")
    order(genuine, ARM_BY_FORCE)
    order(genuine, DISARM_BY_FORCE)
    forger = Station(world, "sdk", key=bytes(31) + b"x")
    forger.send(ARM_BY_FORCE)
    forger.tick(5)
    raw = genuine.codec.encode(dialect.MAVLink_setup_signing_message(1, 1, list(NEW), 77))
    for start, end in ((0, 13), (13, 31), (31, len(raw))):
        genuine.link.write(0, raw[start:end])
        genuine.tick(2)
    assert world.app.keeper is not None
    assert world.app.keeper.state.key == NEW
    renewed = Station(world, "gcs", key=NEW, stamp=world.app.keeper.state.timestamp + 10_000)
    renewed.send(dialect.MAVLink_setup_signing_message(1, 1, list(NEW), 78))
    order(renewed, ARM_BY_FORCE)
    assert world.snapshot is not None
    assert world.snapshot.armed
    world.run(2.0)
    world.shutdown(world.now_us)
    return world, run_dir


def test_no_file_of_the_run_tells_a_key(sailed: tuple[World, Path]) -> None:
    _, run_dir = sailed
    found = files_of(run_dir)
    assert {"inputs.bin", "mavlink.tlog", "run.json", "events.jsonl"} <= {path.name for path in found}
    assert [path.name for path in found for key in (KEY, NEW) if tells(path, key)] == []
    logged = [
        decode(record.frame)
        for part in parts_of(run_dir / "mavlink.tlog")
        for record in tlog.iterate(part.read_bytes())
        if record.frame.message_id == 256
    ]
    assert [message.initial_timestamp for message in logged] == [78], (
        "the message that came in one piece is there, its key is not"
    )


def test_the_run_replays_without_any_key_and_says_that_cryptography_was_not_checked(sailed: tuple[World, Path]) -> None:
    world, run_dir = sailed
    key_file = Path(world.settings.security.key_file)
    key_file.unlink()
    outcome = replay(run_dir)
    assert outcome.identical, summary(outcome, 1.0)
    assert outcome.rows_compared > 100
    assert outcome.unproven > 100
    assert "cryptography was not checked" in summary(outcome, 1.0)
    assert not key_file.exists(), "a replay writes no key"


def test_a_replay_touches_no_key_that_is_there(sailed: tuple[World, Path]) -> None:
    world, run_dir = sailed
    key_file = Path(world.settings.security.key_file)
    key_file.write_bytes(KEY)
    assert replay(run_dir).identical
    assert key_file.read_bytes() == KEY


@pytest.mark.skipif(os.name != "posix", reason="mode bits")
def test_a_run_is_its_owners_and_his_groups_alone(sailed: tuple[World, Path]) -> None:
    _, run_dir = sailed
    assert stat.S_IMODE(run_dir.stat().st_mode) & 0o027 == 0
    for path in files_of(run_dir):
        assert stat.S_IMODE(path.stat().st_mode) & 0o137 == 0, path


def setup_frame(*, signed: bool, system: int = 255) -> bytes:
    signer = Signer(SigningState(KEY, 10**12), 3) if signed else None
    return Codec(system, 190, signer=signer).encode(dialect.MAVLink_setup_signing_message(1, 1, list(NEW), 5))


@pytest.mark.parametrize("signed", [True, False])
@pytest.mark.parametrize("seed", range(20))
def test_the_key_is_blanked_however_the_stream_is_cut_and_nothing_else_is_changed(signed: bool, seed: int) -> None:
    dice = random.Random(seed)
    other = Codec(255, 190).encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    stream = dice.randbytes(dice.randint(0, 300)) + other + setup_frame(signed=signed) + other + dice.randbytes(200)
    blanker, shown, at = KeyBlanker(), b"", 0
    while at < len(stream):
        size = dice.choice((1, 1, 2, 7, 40, 300))
        piece = blanker.receive(stream[at : at + size])
        assert len(piece) == len(stream[at : at + size])
        shown, at = shown + piece, at + size
    assert NEW[:4] not in shown
    changed = [index for index in range(len(stream)) if shown[index] != stream[index]]
    assert len(changed) <= 34
    assert changed[-1] - changed[0] < 36
    frames = [frame for frame in Deframer().receive(shown, 0) if frame.message_id == 256]
    assert [bytes(decode(frame).secret_key) for frame in frames] == [b"\xbb" * 32]


def test_a_wrong_checksum_stays_wrong() -> None:
    raw = bytearray(setup_frame(signed=False))
    raw[-1] ^= 0x55
    assert not Deframer().receive(blank_frame(bytes(raw)), 0)


def test_a_recording_of_the_compact_radio_replays_without_its_key(tmp_path: Path) -> None:
    run_dir = tmp_path / "run"
    run_dir.mkdir()
    found = with_gateway(load(config.path("sim.toml"), ["record.enabled=true"], SimSettings), run_dir)
    world = World(found, seed=3, run_dir=run_dir)
    gateway = shore_gateway(world.settings, 0, run_dir, modem=world.ground("shore"))
    for _ in range(20 * 20):
        world.step()
        gateway.tick(world.now_us)
    assert gateway.twin.is_fresh(world.now_us)
    world.shutdown(world.now_us)
    (run_dir / "radio.key").unlink()
    outcome = replay(run_dir)
    assert outcome.identical, summary(outcome, 1.0)
    assert outcome.unproven > 10

"""The simulated modules are set as real ones are: over their protocol with SET low, and from a TOML that sets one of them wrongly."""

from __future__ import annotations

import random

import pytest

import config
from companion.cli import main
from companion.io.links.radio_port import SIMULATED_SET
from companion.io.log_file import parts_of
from companion.settings import ConfigError, load
from mavlink_bridge.radio.air.codes import ModuleCodes, read_codes
from mavlink_bridge.radio.air.module import ModuleError, fields
from sitl.radio import RadioConfig, RadioPair
from sitl.radio.module import FACTORY_BLOCK, LINE, set_up
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.unit.test_lora_module import Emulator

S = 1_000_000
KEY = bytes(range(1, 17)).hex()


def crosses(vessel="", shore=""):
    """What the shore's host reads of what the vessel's host wrote."""
    pair = RadioPair(RadioConfig(), random.Random(1))
    for end, words in ((pair.vessel, vessel), (pair.shore, shore)):
        end.module.attach(FACTORY_BLOCK[LINE], words)
    pair.vessel.write(b"hello, shore")
    pair.step(3 * S)
    return pair.shore.read()


@pytest.mark.parametrize(
    "words", ["net_id=22222222", "channel=21", "rate_index=4", "band=433", f"encryption=on key={KEY}"]
)
def test_one_end_set_wrongly_hears_nothing_and_both_set_so_hear_each_other(words):
    assert crosses() == b"hello, shore"
    assert crosses(shore=words) == b""
    assert crosses(vessel=words, shore=words) == b"hello, shore"


def test_another_key_hears_nothing_and_a_key_without_encryption_is_none():
    other = bytes(16).hex()
    assert crosses(f"encryption=on key={KEY}", f"encryption=on key={other}") == b""
    assert crosses(f"key={KEY}", f"key={other}") == b"hello, shore"


def test_the_same_node_id_hears_nothing():
    assert crosses(vessel="node_id=CCCC", shore="node_id=CCCC") == b""


@pytest.mark.parametrize("words", ["parity=even", "baud=19200", "stop_bits=2"])
def test_a_serial_line_that_is_set_otherwise_than_its_host_brings_garbage(words):
    found = crosses(shore=words)
    assert len(found) == len(b"hello, shore")
    assert not set(zip(found, b"hello, shore", strict=True)) & {(byte, byte) for byte in range(256)}


def test_a_worlds_file_sets_one_module_wrongly_and_what_cannot_be_is_refused():
    base = ("radio.url=mem:radio", 'sensors=[{url="mem:nmea"}]', "actuators.url=mem:ard", "endpoints=[]")
    world = World(load(config.path("sim.toml"), [*base, 'world.radio.shore_module="net_id=22222222"'], SimSettings), 1)
    near, far = (end.module.block for end in (world.surroundings.radio.vessel, world.surroundings.radio.shore))
    assert (near[8:12].hex(), far[8:12].hex()) == ("11111111", "22222222")
    with pytest.raises(ConfigError, match="a whole number from 0 to 255"):
        load(config.path("sim.toml"), [*base, 'world.radio.vessel_module="channel=999"'], SimSettings)


def test_a_boats_parity_is_its_simulated_modules_too():
    overrides = ["radio.url=mem:radio?parity=E&stop=2", 'sensors=[{url="mem:nmea"}]', "actuators.url=mem:ard"]
    settings = load(config.path("sim.toml"), overrides, SimSettings)
    module = World(settings, 1).surroundings.radio.vessel.module
    assert module.block[LINE] == set_up(FACTORY_BLOCK, "parity=even stop_bits=2")[LINE] == module.host_line


def test_the_simulated_set_pin_is_a_file_beside_the_port(tmp_path):
    """Low while it is there: the same words configure a simulated module and a real one."""
    overrides = [
        f"radio.url=serial:{tmp_path}/lora-vessel?baud=9600",
        'sensors=[{url="mem:nmea"}]',
        "actuators.url=mem:ard",
    ]
    world = World(load(config.path("sim.toml"), overrides, SimSettings), 1)
    module, pin = world.surroundings.radio.vessel.module, tmp_path / f"lora-vessel{SIMULATED_SET}"
    pin.touch()
    world.step()
    assert module.set_low
    pin.unlink()
    world.step()
    assert not module.set_low
    world.shutdown(world.now_us)


# ---- codes that were learned


def test_what_the_bench_finds_is_written_down_shown_and_can_be_set(tmp_path, capsys):
    emulator, codes = Emulator(block=set_up(FACTORY_BLOCK, "rate_index=4")), str(tmp_path / "codes.toml")
    there = [emulator.path, "--set-by", "none", "--codes", codes]
    assert main(["lora", "set", "rate=656", *there]) == 2
    assert "lora bench rate=656" in capsys.readouterr().err
    assert main(["lora", "bench", "rate=656", "mhz=868.92", *there]) == 0
    assert main(["lora", "show", *there]) == 0
    shown = capsys.readouterr().out
    assert "656 bit/s (index 4)" in shown
    assert "20 (868.92 MHz)" in shown
    assert main(["lora", "set", "rate_index=0", *there]) == 0
    assert main(["lora", "set", "rate=656", *there]) == 0
    assert emulator.module.block[2] == 4


@pytest.mark.parametrize("fact", ["rate=9", "rate=fast", "mhz=2400", "colour=3"])
def test_what_can_be_no_fact_is_not_written_down(fact, tmp_path, capsys):
    codes = tmp_path / "codes.toml"
    assert main(["lora", "bench", fact, Emulator().path, "--set-by", "none", "--codes", str(codes)]) == 1
    assert "nothing was written down" in capsys.readouterr().err
    assert not codes.exists()


def test_without_codes_numbers_stay_numbers():
    assert next(each.shown for each in fields(FACTORY_BLOCK, ModuleCodes()) if each.name == "Data Rate") == "index 0"
    with pytest.raises(ModuleError, match="0 to 9"):
        read_codes({"rates": {"12": 656}})


def test_what_really_happened_takes_its_share_of_a_recording_and_no_more(tmp_path):
    """It grew until nothing else was kept: after 15 hours of a simulation every new log was deleted within five seconds."""
    settings = load(config.path("sim.toml"), ["record.free_floor_mb=0"], SimSettings)
    small = settings.model_copy(update={"record": settings.record.model_copy(update={"max_mb": 1})})
    world = World(small, 1, run_dir=tmp_path)
    world.run(30.0)
    world.shutdown(world.now_us)
    sizes = [path.stat().st_size for path in parts_of(tmp_path / "truth.csv")]
    assert len(sizes) > 1
    assert max(sizes) <= (1 << 20) // 16 + 4096

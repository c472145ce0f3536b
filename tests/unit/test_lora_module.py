"""``companion lora`` against a module's emulator on a pseudo-terminal, and radio profiles against the law."""

import os
import pty
import random
import subprocess
import sys
import threading
import tomllib
import tty

import pytest

import config
from companion.cli import main
from mavlink_bridge.radio.air.module import ModuleError, check_block, differences, fields, wanted
from mavlink_bridge.radio.air.profile import RadioProfile
from sitl.radio.module import FACTORY_BLOCK, RadioModule
from tools.lora_rig import profile

SHIPPED = sorted(path.stem for path in config.path("radio").glob("*.toml"))


class Emulator:
    """A module in configuration mode on a pty, served by a thread."""

    def __init__(self, model="LORA6500PRO_VER3.1_E", block=FACTORY_BLOCK):
        self.module = RadioModule("emulated", random.Random(0), gap_us=0, buffer_bytes=512, split=False, model=model)
        self.module.block = block
        self.module.set_low = True
        self._near, far = pty.openpty()
        tty.setraw(far)
        self.path = os.ttyname(far)
        self._far = far
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self):
        now_us = 0
        while True:
            try:
                data = os.read(self._near, 256)
            except OSError:
                return
            now_us += 1_000_000 if data[:1] == b"\xaa" else 1
            self.module.from_host(data, now_us)
            os.write(self._near, self.module.read(now_us + 10**9))


def test_show_reads_the_vendors_fields(capsys):
    emulator = Emulator()
    assert main(["lora", "show", emulator.path, "--set-by", "none"]) == 0
    text = capsys.readouterr().out
    for words in (
        "LORA6500PRO_VER3.1_E",
        "NET ID        11111111",
        "NODE ID       BBBB",
        "Non Mesh",
        "Channel       20",
        "9600",
    ):
        assert words in text


def test_apply_changes_known_bytes_only_and_verifies(capsys):
    block = FACTORY_BLOCK[:2] + b"\x06" + FACTORY_BLOCK[3:17] + bytes(range(16))
    emulator = Emulator(block=block)
    assert main(["lora", "apply", "o-10", emulator.path, "--side", "shore", "--set-by", "none"]) == 0
    have = emulator.module.block
    assert (have[0], have[3]) == (21, 6)
    assert have[12:14] == b"\xbb\xbc"
    assert have[2] == 6
    assert have[17:] == bytes(range(16))
    assert main(["lora", "show", emulator.path, "--profile", "o-10", "--side", "shore", "--set-by", "none"]) == 0
    assert main(["lora", "show", emulator.path, "--profile", "n-0.1", "--side", "shore", "--set-by", "none"]) == 1
    assert "differs: Channel: 21 (869.52 MHz, inferred), wanted 20 (868.92 MHz, inferred)" in capsys.readouterr().out


def test_single_settings_are_set_and_read_back(tmp_path, capsys):
    emulator = Emulator()
    key = tmp_path / "module.key"
    key.write_bytes(bytes(range(1, 17)))
    key.chmod(0o600)
    words = [
        "channel=21",
        "power=6",
        "rate_index=0",
        "net_id=12345678",
        "parity=even",
        "encryption=on",
        f"key_file={key}",
    ]
    assert main(["lora", "set", *words, emulator.path, "--set-by", "none"]) == 0
    have = emulator.module.block
    assert (have[0], have[2], have[3], have[7], have[8:12], have[16]) == (21, 0, 6, 3, bytes.fromhex("12345678"), 1)
    assert have[17:] == key.read_bytes()
    assert have[12:14] == FACTORY_BLOCK[12:14]
    capsys.readouterr()
    assert main(["lora", "show", emulator.path, "--set-by", "none"]) == 0
    told = capsys.readouterr().out
    assert "AES key       set" in told
    assert key.read_bytes().hex() not in told
    assert "21 (869.52 MHz, inferred)" in told


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("chanel=21", "no such setting; there are channel"),
        ("power=9", "a whole number from 0 to 7"),
        ("baud=112500", "one of 1200"),
        ("net_id=12", "8 hexadecimal digits"),
        ("lbt=on", "no such flag"),
        ("key_file=nowhere.key", "No such file"),
        ("channel", "NAME=VALUE"),
    ],
)
def test_a_setting_that_cannot_be_is_refused_and_nothing_written(word, told, capsys):
    emulator = Emulator()
    assert main(["lora", "set", "power=3", word, emulator.path, "--set-by", "none"]) in (1, 2)
    words = capsys.readouterr().err
    assert told in words
    assert "nothing was written" in words
    assert emulator.module.block == FACTORY_BLOCK


def test_a_module_of_unknown_settings_is_not_reset(capsys):
    emulator = Emulator(block=b"\x15" + FACTORY_BLOCK[1:] + bytes(7))
    before = emulator.module.block
    assert main(["lora", "reset", emulator.path, "--set-by", "none"]) == 1
    assert "nothing was written" in capsys.readouterr().err
    assert emulator.module.block == before


def test_reset_gives_factory_settings():
    emulator = Emulator(block=b"\x15" + FACTORY_BLOCK[1:])
    assert main(["lora", "reset", emulator.path, "--set-by", "none"]) == 0
    assert emulator.module.block == FACTORY_BLOCK


@pytest.mark.parametrize("changes", [{"model": "XYZ9000_V1"}, {"block": FACTORY_BLOCK + bytes(7)}])
def test_unknown_models_and_lengths_are_left_alone(changes, capsys):
    emulator = Emulator(**changes)
    before = emulator.module.block
    assert main(["lora", "apply", "o-10", emulator.path, "--set-by", "none"]) == 1
    assert "nothing was written" in capsys.readouterr().err
    assert emulator.module.block == before


def test_a_silent_port_says_what_to_look_at(capsys):
    near, far = pty.openpty()
    tty.setraw(far)
    assert main(["lora", "show", os.ttyname(far), "--set-by", "none"]) == 1
    assert "SET low" in capsys.readouterr().err
    os.close(near)


def test_a_newer_block_has_its_flag():
    block = FACTORY_BLOCK + b"\1"
    assert [field.name for field in fields(block)][-1] == "LBT"
    assert differences(block, wanted(profile("o-10"), "vessel", check_block(block)))[-1] == "LBT: on, wanted off"
    with pytest.raises(ModuleError, match="no such flag"):
        wanted(profile("o-10", lbt=True), "vessel", FACTORY_BLOCK)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_profiles_are_legal(name):
    found = RadioProfile.model_validate(tomllib.loads(config.path("radio", f"{name}.toml").read_text("utf-8")))
    assert found.erp_dbm <= found.band_rule.erp_dbm + 0.01
    assert found.airtime_us(found.max_frame_bytes) <= 1_000_000


def test_the_seeds_settings_are_the_tenth_of_a_percent():
    found = profile("n-0.1")
    assert (found.frequency_mhz, found.channel, found.net_id, found.power_level) == (868.92, 20, "11111111", 7)
    assert (found.baud, found.parity, found.data_bits, found.stop_bits) == (9600, "none", 8, 1)
    assert found.hour_us == 3_600_000


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"attenuation_db": 0.0}, "16.0 dB over EN 300 220-2 band N"),
        ({"rule": "O"}, "not inside EN 300 220-2 band O"),
        ({"frequency_mhz": 869.52}, "channel 20 should be 868.92 MHz"),
        ({"node_shore": "bbbb"}, "must differ"),
        ({"phy": "SF7"}, "not the air_rate of 656"),
        ({"role": "router"}, "needs mesh"),
    ],
)
def test_contradictions_are_refused_with_the_rules_name(changes, words):
    with pytest.raises(ValueError, match=words.replace("(", r"\(")):
        profile("n-0.1", **changes)


def test_a_module_header_shortens_the_frames():
    assert profile("o-10", module_header_bytes=2).max_frame_bytes < 62


def test_gateway_and_lora_need_nothing_of_posix():
    code = """
import sys
for name in ('termios', 'fcntl', 'pty', 'tty', 'grp', 'pwd', 'resource', 'select.epoll'):
    sys.modules[name] = None
import types
serial = types.ModuleType('serial'); serial.Serial = object; serial.SerialException = OSError
sys.modules['serial'] = serial
import companion.gateway, companion.commands.gateway, companion.commands.lora
from companion.io.links.table import SCHEMES, check_link
assert SCHEMES['serial'].made_by.endswith('ComLink')
check_link('serial:COM5?baud=9600')
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)

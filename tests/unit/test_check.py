"""``companion check`` understands every file that ships, a gateway's too, and names what is missing."""

from __future__ import annotations

import os
import re

import pytest

import config as shipped
from companion.cli import main
from companion.configuration import vessel_settings
from companion.core.steer.law import lowered_text
from companion.settings import ConfigError
from companion.tuning.fitted import vessel_toml
from sitl.gateway import simulation_key
from tools.benches.cells.drawn_hulls import drawn


@pytest.mark.parametrize("name", ["boat.toml", "sim.toml", "replay-nmea.toml", "gateway.toml"])
def test_the_shipped_files_are_good(name, capsys):
    assert main(["check", str(shipped.path(name))]) == 0
    assert ": good" in capsys.readouterr().out


def test_a_gateways_mistakes_are_all_told(tmp_path, capsys):
    path = tmp_path / "gateway.toml"
    path.write_text('url = "serial:"\nprofile = "o-11"\n[[endpoints]]\nname = "x"\nurl = "udp:nowhere"\n')
    assert main(["check", str(path)]) == 2
    told = capsys.readouterr().err
    assert "url = 'serial:'" in told
    assert "endpoints 'x' url" in told
    assert "o-11" in told


GATEWAY = """\
url = "serial:/dev/ttyUSB0?baud=9600"
key_file = "CONFIG_DIR/radio.key"
store = "CONFIG_DIR/gateway.db"
vessel_config = "CONFIG_DIR/boat.toml"
[security]
key_file = "CONFIG_DIR/links.key"
[[endpoints]]
name = "gcs"
url = "udp://127.0.0.1:14550"
"""


@pytest.fixture
def gateway_file(tmp_path):
    for name in ("radio.key", "links.key"):
        (tmp_path / name).write_bytes(os.urandom(32))
        (tmp_path / name).chmod(0o600)
    (tmp_path / "boat.toml").write_text(shipped.path("boat.toml").read_text())
    path = tmp_path / "gateway.toml"
    path.write_text(GATEWAY)
    assert main(["check", str(path)]) == 0
    return path


@pytest.mark.parametrize(
    ("store", "told"),
    [
        ("radio.key", "is key_file; give the store a file of its own"),
        ("./radio.key", "is key_file"),
        ("links.key", "is security.key_file"),
        ("boat.toml", "is vessel_config"),
        ("gateway.toml", "is this very configuration"),
        ("state/", "is a folder"),
    ],
)
def test_a_gateways_store_is_no_file_that_serves_something_else(gateway_file, capsys, store, told):
    """check called it fine, and the gateway moved the radio's key away."""
    before = {each.name: each.read_bytes() for each in gateway_file.parent.iterdir()}
    for command in (["check", str(gateway_file)], ["gateway", str(gateway_file), "--duration", "0.1"]):
        assert main([*command, "--set", f"store={gateway_file.parent}/{store}"]) == 2
        assert told in capsys.readouterr().err
    assert {each.name: each.read_bytes() for each in gateway_file.parent.iterdir()} == before


def test_a_gateways_endpoint_at_an_address_that_comes_later_is_told(gateway_file, capsys):
    gateway_file.write_text(
        f'{GATEWAY}\n[[endpoints]]\nname = "vpn"\nurl = "tcp-listen://192.0.2.1:5799"\nlink_class = "telemetry"\n'
    )
    assert main(["check", str(gateway_file)]) == 0
    assert "this computer has no such address now; nobody is heard there until it has" in capsys.readouterr().out


@pytest.mark.parametrize("store", ["~/gateway.db", "$HOME/gateway.db", "/etc/gateway.db", ":memory:"])
def test_a_gateways_store_lies_where_a_vessels_may(gateway_file, capsys, store):
    assert main(["check", str(gateway_file), "--set", f"store={store}"]) == 2
    assert f"store = {store!r}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("key", "value", "mend"),
    [
        ("url", "", "is empty; give the shore modem's port"),
        ("vessel_config", "no.toml", "no such file"),
        ("store", "x" * 300, "a name of 300 bytes; 220 is the most"),
        ("store", "/".join(["x" * 200] * 25), "bytes; 3800 is the most"),
    ],
)
def test_a_gateways_mistake_has_its_file_its_key_and_the_mend(gateway_file, capsys, key, value, mend):
    for command in ("check", "gateway"):
        assert main([command, str(gateway_file), "--set", f"{key}={value!r}"]) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"{gateway_file}: 1 mistake(s)")
        assert f"{key} = '{value[:20]}" in said
        assert mend in said


def test_what_is_wrong_in_a_gateways_vessel_is_told_with_the_key_that_names_it(gateway_file, capsys):
    (gateway_file.parent / "boat.toml").write_text("[depth]\nmin_altitude_m = -4\n")
    assert main(["check", str(gateway_file)]) == 2
    assert re.search(r"vessel_config = '.*boat.toml': line 2: depth.min_altitude_m = -4", capsys.readouterr().err)


@pytest.mark.parametrize("key", ["store", "record.directory"])
def test_a_name_that_no_disk_takes_is_a_mistake(key, capsys):
    assert main(["check", str(shipped.path("boat.toml")), "--set", f"{key}={'x' * 256}"]) == 2
    assert f"{key} = 'xxx" in capsys.readouterr().err


def test_an_output_of_which_only_something_else_is_said_keeps_its_own_letter(tmp_path, capsys):
    """'id: missing' was said, and what else was wrong in the table only when it was there."""
    path = tmp_path / "boat.toml"
    text = shipped.path("boat.toml").read_text()
    path.write_text(
        text + "\n[actuators.board.thruster_port]\nreverse = true\n[actuators.board.rudder_starboard]\ntrim_us = 5\n"
    )
    board = vessel_settings(path, ()).actuators.board
    assert [channel.id for channel in board.channels] == ["m", "M", "l", "L"]
    assert board.thruster_port.reverse
    path.write_text(text + "\n[actuators.board.thruster_port]\ntrim_us = 900\nus_zero = 3\n")
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert "trim_us = 900" in said
    assert "us_zero = 3" in said


BOAT_TEXTS = (
    *("store", "record.directory", "depth.map.file", "security.key_file", "page.key_file", "radio.key_file", "vessel"),
    *("actuators.url", "sensors.0.url", "sensors.0.nmea.sentences", "endpoints.0.url", "radio.url", "system.name"),
)
GATEWAY_TEXTS = ("url", "key_file", "vessel_config", "store", "profile", "name", "endpoints.0.url", "security.key_file")


@pytest.mark.parametrize(("name", "keys"), [("boat.toml", BOAT_TEXTS), ("gateway.toml", GATEWAY_TEXTS)])
@pytest.mark.parametrize("char", ["\0", "\n", "\x1b"])
def test_a_text_with_a_control_character_is_refused_by_key_and_all_at_once(capsys, name, keys, char):
    """A path with such a character was a traceback; a sensor's address with one passed, and ended the run under way."""
    words = [word for key in keys for word in ("--set", f"{key}=a{char}b")]
    assert main(["check", str(shipped.path(name)), *words]) == 2
    said = capsys.readouterr().err
    rows = said.splitlines()
    for key in keys:
        wanted = key.replace("sensors.0.", "").replace("endpoints.0.", "")
        assert any(f"{wanted} = {f'a{char}b'!r}: holds {char!r}, which no screen shows" in row for row in rows), (
            key,
            said,
        )


def test_a_key_that_is_not_made_yet_is_told(tmp_path, capsys):
    words = ["check", str(shipped.path("sim.toml")), "--set", "radio.protocol=compact"]
    assert main([*words, "--set", f"radio.key_file={tmp_path}/radio.key"]) == 0
    assert "NOT YET" in capsys.readouterr().out
    assert main([*words, "--set", "radio.profile=nothing"]) == 2
    assert "nothing" in capsys.readouterr().err


def test_every_socket_is_listed_with_whom_it_hears_and_what_he_may(tmp_path, capsys):
    assert main(["check", str(shipped.path("sim.toml"))]) == 0
    told = [line.split("socket ")[1].strip() for line in capsys.readouterr().out.splitlines() if "  socket " in line]
    assert told == [
        "compass: TCP 127.0.0.1, a free port; 127.0.0.1:3000 only, which is called; sensor: is believed what it measures",
        "gcs: UDP 127.0.0.1, a free port; 127.0.0.1:14550 only; trusted: obeys every order of whom it hears, unsigned",
        "sdk: UDP 127.0.0.1, a free port; 127.0.0.1:14540 only; trusted: obeys every order of whom it hears, unsigned",
        "tcp: TCP 127.0.0.1 port 5760; programs on this computer; trusted: obeys every order of whom it hears, unsigned",
    ]


@pytest.mark.parametrize(
    ("url", "told"),
    [
        ("udp-listen://:14550", "UDP 0.0.0.0 port 14550; EVERY MACHINE that reaches this computer; trusted"),
        ("tcp-listen://0.0.0.0:5760", "TCP 0.0.0.0 port 5760; EVERY MACHINE that reaches this computer; trusted"),
        ("udp://192.168.1.7:14550", "UDP any address, a free port; 192.168.1.7:14550 only; trusted"),
        ("udp://[::1]:14550?local=14600", "UDP [::1], port 14600; ::1:14550 only; trusted"),
        (
            "udp-broadcast://192.168.1.255:14550",
            "UDP any address, a free port; everybody in the network of 192.168.1.255",
        ),
    ],
)
def test_a_door_that_others_reach_says_so(url, told, capsys):
    endpoints = f'endpoints=[{{name="lan",url="{url}",insecure=true}}]'
    for name in ("boat.toml", "gateway.toml"):
        assert main(["check", str(shipped.path(name)), "--set", endpoints]) == 0
        said = capsys.readouterr().out
        assert f"socket      lan: {told}" in said
        assert ("WARNING     endpoint lan takes orders from anybody" in said) == ("::1" not in url)


@pytest.mark.parametrize(
    ("changes", "key", "told"),
    [
        (
            ['sensors=[{name="nmea",url="udp-listen://:10110"%s}]'],
            "sensors 'nmea'",
            "believes whoever sends where the boat is",
        ),
        (['sensors=[{name="nmea",url="tcp-listen://0.0.0.0:10110"%s}]'], "sensors 'nmea'", "believes whoever sends"),
        (
            ['radio={url="serial:/dev/ttyUSB0",protocol="mavlink"%s}'],
            "radio",
            "whoever transmits on the channel commands the boat",
        ),
        (['radio={url="serial:/dev/ttyUSB0",protocol="json"%s}'], "radio", "has no key"),
    ],
)
def test_what_anybody_may_pretend_to_be_needs_the_owners_word(changes, key, told, capsys):
    boat = str(shipped.path("boat.toml"))
    assert main(["check", boat, *[word for item in changes for word in ("--set", item % "")]]) == 2
    said = capsys.readouterr().err
    assert f"{key}: " in said
    assert told in said
    assert "insecure = true" in said
    assert main(["check", boat, *[word for item in changes for word in ("--set", item % ",insecure=true")]]) == 0
    assert f"WARNING     {key}: " in capsys.readouterr().out


@pytest.mark.parametrize(
    "change",
    [
        'sensors=[{name="nmea",url="udp-listen://127.0.0.1:10110"}]',
        'sensors=[{name="nmea",url="tcp://192.168.1.20:10110"}]',
        'radio={url="serial:/dev/ttyUSB0",protocol="compact",key_file="none-yet.key"}',
    ],
)
def test_what_nobody_else_reaches_needs_none(change, capsys):
    assert main(["check", str(shipped.path("boat.toml")), "--set", change]) == 0
    assert "WARNING" not in capsys.readouterr().out


def test_the_simulators_key_is_no_key_for_a_boat_or_its_gateway(tmp_path, capsys):
    key = simulation_key(tmp_path)
    boat = [
        "check",
        str(shipped.path("boat.toml")),
        "--set",
        "radio.protocol=compact",
        "--set",
        f"radio.key_file={key}",
    ]
    assert main([*boat, "--set", "radio.url=serial:/dev/ttyUSB0"]) == 2
    assert "radio.key_file" in capsys.readouterr().err
    assert main(["check", str(shipped.path("gateway.toml")), "--set", f"key_file={key}"]) == 2
    assert "the simulator's key, which everybody has" in capsys.readouterr().err
    ours, theirs = os.openpty()
    (tmp_path / "lora-vessel").symlink_to(os.ttyname(theirs))
    assert main([*boat, "--set", f"radio.url=serial:{tmp_path}/lora-vessel"]) == 0, "its modem is the simulator's"
    os.close(ours)
    os.close(theirs)


def test_the_simulators_key_beside_its_world(tmp_path):
    """What ``companion sim --world-only --gateway`` tells a separate vessel: the modem stands in the directory of the run."""
    key = simulation_key(tmp_path)
    words = ["radio.protocol=compact", "radio.profile=o-10", f"radio.key_file={key}"]
    config = shipped.path("sim.toml")
    ours, theirs = os.openpty()
    modem = tmp_path / "lora-vessel"
    modem.symlink_to(os.ttyname(theirs))
    assert vessel_settings(config, words, to_sail=True, run_dir=tmp_path).radio.key_file == str(key)
    modem.unlink()
    modem.symlink_to("/dev/ttyUSB0")
    with pytest.raises(ConfigError, match="the simulator's key"):
        vessel_settings(config, words, to_sail=True, run_dir=tmp_path)
    os.close(ours)
    os.close(theirs)


def test_the_speed_that_it_tells_to_take_is_one_that_it_takes(capsys, tmp_path):
    """A boat of 1.478 m/s was told ``1.5: more than the hull's top speed; at most 1.5``."""
    hull = tmp_path / "small.toml"
    hull.write_text(vessel_toml(drawn("small", 7)), encoding="utf-8")
    settings = [str(shipped.path("sim.toml")), "--set", f"vessel='{hull}'", "--set"]
    assert main(["check", *settings, "mission.cruise_speed_mps=1.5"]) == 2
    most = re.search(r"more than the hull's top speed; at most ([\d.]+) m/s", capsys.readouterr().err)
    assert most is not None
    assert main(["check", *settings, f"mission.cruise_speed_mps={most[1]}"]) == 0


def test_a_top_speed_that_is_lowered_by_less_than_is_told_is_not_told():
    assert lowered_text(2.64, 2.71) != ""
    assert lowered_text(2.66, 2.71) == "", "from 2.7 to 2.7 m/s"


def charted(tmp_path, depth):
    lines = [f"{-8.7060 + 1e-4 * k:.4f} {41.1850 + 1e-4 * k:.4f} {depth:.1f}" for k in range(20)]
    chart = tmp_path / "chart.xyz"
    chart.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [str(shipped.path("sim.toml")), "--set", f"depth.map.file={chart}", "--set", "depth.map.order=lon-lat"]


def test_a_chart_is_told_where_it_lies_and_what_it_holds(tmp_path, capsys):
    """One with latitude and longitude exchanged lies a thousand miles away, and nothing else says so."""
    assert main(["check", *charted(tmp_path, 7.5)]) == 0
    told = capsys.readouterr().out
    assert re.search(
        r"  chart .*chart\.xyz: 0\.2 x 0\.2 km about 41\.18\d\d -8\.70\d\d, .* known, 7\.5 to 7\.5 m below datum", told
    )
    assert "positive downwards" not in told


def test_a_chart_of_heights_is_warned_of(tmp_path, capsys):
    assert main(["check", *charted(tmp_path, -7.5)]) == 0
    assert (
        "lies above datum everywhere, -7.5 to -7.5 m; depths are metres, positive downwards" in capsys.readouterr().out
    )


SEED = [
    *("--set", 'vessel="blueboat"', "--set", 'steering.profile="seed"'),
    *("--set", "steering.seed.speed_gains={kp=0.5,ki=0.1}"),
]


@pytest.mark.parametrize(("gains", "holds"), [("{kp=0.4,kd=0.2}", True), ("{kp=8.0,kd=0.1}", False)])
def test_margins_of_the_seeds_law_are_told_and_gains_without_any_are_not_good(gains, holds, capsys):
    """It said "good", and where margins may be read; a boat whose gains do not hold swerved 27 m off."""
    words = [*SEED, "--set", f"steering.seed.heading_gains={gains}"]
    assert main(["check", str(shipped.path("boat.toml")), *words]) == 0
    told = capsys.readouterr().out
    assert re.search(r"heading +law 'seed': at least \d+ dB and \d+ deg", told)
    assert (": good" in told) is holds
    assert ("SEED_HDG_P, _I, _D miss their margins at" in told) is not holds

"""``companion check`` understands every file that ships, a gateway's too, and names what is missing."""

from __future__ import annotations

import pytest

import config as shipped
from companion.cli import main


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
    assert "endpoints.0.url" in told
    assert "o-11" in told


def test_a_key_that_is_not_made_yet_is_told(tmp_path, capsys):
    words = ["check", str(shipped.path("sim.toml")), "--set", "radio.protocol=compact"]
    assert main([*words, "--set", f"radio.key_file={tmp_path}/radio.key"]) == 0
    assert "NOT YET" in capsys.readouterr().out
    assert main([*words, "--set", "radio.profile=nothing"]) == 2
    assert "nothing" in capsys.readouterr().err

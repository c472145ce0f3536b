"""Where ``companion plan`` looks for the vessel, and what it says when there is none."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

import config as shipped
from companion.cli import main
from companion.commands.plan import find, link
from companion.settings import ConfigError


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("boat.toml", ["udpin://0.0.0.0:14550", "tcpout://127.0.0.1:5760"]),
        ("gateway.toml", ["udpin://0.0.0.0:14550", "tcpout://127.0.0.1:5760"]),
        ("sim.toml", ["udpin://0.0.0.0:14550", "udpin://0.0.0.0:14540", "tcpout://127.0.0.1:5760"]),
    ],
)
def test_the_endpoints_of_a_configuration_are_where_the_vessel_is(name: str, wanted: list[str]) -> None:
    assert find.places(shipped.path(name), "127.0.0.1") == wanted
    assert set(wanted) <= set(find.USUAL), "and without a configuration they are all among the places that are tried"


def test_a_vessel_on_another_computer(tmp_path: Path) -> None:
    boat = tmp_path / "boat.toml"
    boat.write_text(
        '[[endpoints]]\nname = "a"\nurl = "tcp-listen://0.0.0.0:5761"\n'
        '[[endpoints]]\nname = "b"\nurl = "udp-listen://:14551"\n'
        '[[endpoints]]\nname = "c"\nurl = "tcp-listen://0.0.0.0:5762"\nlink_class = "signed"\n'
        '[[endpoints]]\nname = "d"\nurl = "serial:/dev/ttyUSB0"\n'
    )
    assert find.places(boat, "boat.local") == ["tcpout://boat.local:5761", "udpout://boat.local:14551"]


def test_what_cannot_be_reached_is_told_with_its_reason(tmp_path: Path) -> None:
    boat = tmp_path / "boat.toml"
    boat.write_text('[[endpoints]]\nname = "lan"\nurl = "udp-listen://:14551"\nlink_class = "signed"\n')
    with pytest.raises(ConfigError) as told:
        find.places(boat, "127.0.0.1")
    assert "endpoint lan asks for signatures, which MAVSDK does not make" in told.value.mistakes
    with pytest.raises(ConfigError):
        find.places(tmp_path / "none.toml", "127.0.0.1")


class FakePlace:
    """Opens or not, and hears a vessel or not."""

    looks: int = 0

    def __init__(self, url: str) -> None:
        self.url = url
        if "bad" in url:
            raise link.LinkError("the port is taken")

    def vessel(self, wait_s: float) -> link.Vessel | None:
        FakePlace.looks += 1
        return object() if "good" in self.url and FakePlace.looks > 2 else None  # type: ignore[return-value]


def test_each_place_is_looked_at_in_turn_until_the_time_is_over(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now_s = [0.0]

    def tick() -> float:
        now_s[0] += 0.25
        return now_s[0]

    monkeypatch.setattr(link.time, "monotonic", tick)
    monkeypatch.setattr(link.time, "sleep", lambda wait_s: None)
    assert link.find(["bad", "silent", "good"], 10.0, FakePlace) is not None  # type: ignore[arg-type]
    assert "found at good" in capsys.readouterr().err
    with pytest.raises(link.LinkError) as told:
        link.find(["bad", "silent"], 5.0, FakePlace)  # type: ignore[arg-type]
    assert "no vessel found in 5 s; tried:\n  bad: the port is taken\n  silent: open, but no vessel" in str(told.value)
    assert "--config" in str(told.value)
    assert capsys.readouterr().err.count("looking for the vessel at silent") == 1


def test_a_server_that_is_not_there_is_said_to_be_none(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    if importlib.util.find_spec("mavsdk") is None:
        pytest.skip("no mavsdk")
    words = ["plan", "download", str(tmp_path / "x.plan"), "--url", "tcpout://127.0.0.1:1", "--wait", "0.2"]
    assert main(words) == 1
    assert "tcpout://127.0.0.1:1: nothing answers there: Connection refused" in capsys.readouterr().err

"""The status socket: every watcher sees every text and the newest picture, and none can disturb the vessel or another."""

from __future__ import annotations

import json
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from companion.cli import main
from companion.io.local_socket import LINE_MAX, PEERS_MAX, LocalServer, connect
from companion.settings import ConfigError
from companion.status.client import Client, LostError, places, reach
from companion.status.orders import Challenges
from companion.status.picture import NoPictureError, dumps, from_fields, picture_of
from companion.status.service import StatusService
from mavlink_bridge.language.messages import LogText, Severity
from tests.unit.test_status import snapshot

TICK_US = 50_000


class Nobody:
    """A vessel that is never asked for anything."""

    def submit(self, body: object, answer: object = None, *, station: object = None) -> None:
        raise AssertionError("no order was given")


class Vessel:
    """A service, driven tick by tick."""

    def __init__(self, path: Path) -> None:
        self.service = StatusService(LocalServer(path), Nobody(), Challenges(None, "ab" * 16, os.urandom), name="boat")  # type: ignore[arg-type]
        self.t_us = 0
        self.texts = 0

    def run(self, ticks: int, *texts: str) -> None:
        for tick in range(ticks):
            self.t_us += TICK_US
            told = [
                LogText(self.texts + number + 1, self.t_us, Severity.WARNING, text) for number, text in enumerate(texts)
            ]
            told = told if tick == 0 else []
            self.texts += len(told)
            self.service.update(snapshot(self.t_us, texts=tuple(told)))


@pytest.fixture
def vessel(tmp_path: Path) -> Iterator[Vessel]:
    found = Vessel(tmp_path / "status.sock")
    yield found
    found.service.close()


def messages(client: Client) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    while new := list(client.poll()):
        found += new
    return found


def pictures(client: Client) -> list[dict[str, Any]]:
    return [message["picture"] for message in messages(client) if "picture" in message]


def come(vessel: Vessel) -> Client:
    return Client(vessel.service._server.path, wait_s=0.002)


def test_a_watcher_is_greeted_and_sees_every_text_of_twelve_events(vessel: Vessel) -> None:
    client = come(vessel)
    seen: dict[int, str] = {}
    for event in range(12):
        vessel.run(20, f"event {event}")
        for message in messages(client):
            assert "hello" not in message or message["hello"]["name"] == "boat"
            seen |= {text["number"]: text["text"] for text in message.get("picture", {}).get("texts", [])}
    assert list(seen.values()) == [f"event {event}" for event in range(12)]


def test_who_comes_later_sees_what_was_said_before(vessel: Vessel) -> None:
    for event in range(12):
        vessel.run(2, f"event {event}")
    late = come(vessel)
    vessel.run(10)
    assert [text["text"] for text in pictures(late)[-1]["texts"]] == [f"event {event}" for event in range(12)]


def test_four_pictures_a_second_whoever_else_watches_and_however(vessel: Vessel) -> None:
    """One does not read, one is killed in the middle of a message, one hangs up; the fourth sees all and the newest."""
    slow, killed, gone, good = (come(vessel) for _ in range(4))
    found = []
    for second in range(24):
        vessel.run(1, "x" * 50)
        for _ in range(19):
            found += pictures(good)
            vessel.run(1)
        found += pictures(good)
        if second == 10:
            killed._stream.shutdown(socket.SHUT_RDWR)
        if second == 20:
            gone.close()
    assert len(found) == 96
    assert found[-1]["t_s"] == pytest.approx(vessel.t_us * 1e-6, abs=0.25)
    old = pictures(slow)
    assert len(old) < 12, "what was not read in time was not kept"
    for _ in range(20):
        vessel.run(1)
        old = pictures(slow) or old
    assert old[-1]["t_s"] == pytest.approx(vessel.t_us * 1e-6, abs=0.6)


def test_who_never_reads_is_let_go_and_no_more_than_eight_are_served(vessel: Vessel) -> None:
    crowd = [come(vessel) for _ in range(PEERS_MAX)]
    vessel.run(60)
    late = come(vessel)
    vessel.run(20)
    with pytest.raises(LostError):
        messages(late)
    vessel.run(20 * 60, *("y" * 200 for _ in range(20)))
    late = come(vessel)
    vessel.run(20)
    assert pictures(late)
    assert crowd


@pytest.mark.parametrize("junk", [b"x" * (LINE_MAX + 1), b"not json\n", b"[]\n", b"[" * 1500 + b"\n", b"\xff\xfe\n"])
def test_nonsense_ends_its_own_connection_only(vessel: Vessel, junk: bytes) -> None:
    good, bad = come(vessel), come(vessel)
    vessel.run(5)
    bad._stream.sendall(junk)
    vessel.run(10)
    with pytest.raises(LostError):
        messages(bad)
    messages(good)
    vessel.run(10)
    assert pictures(good)


def test_the_socket_is_its_owners_only_and_goes_with_the_process(tmp_path: Path) -> None:
    path = tmp_path / "status.sock"
    server = LocalServer(path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    server.close()
    assert not path.exists()


def test_a_path_that_is_longer_than_an_address_serves_too(tmp_path: Path) -> None:
    path = tmp_path / ("deep" * 30) / ("er" * 30) / "status.sock"
    server = LocalServer(path)
    stream = connect(path, 1.0)
    assert len(server.look()) == 1, "who connects is served"
    stream.close()
    server.close()


def test_the_file_of_a_killed_process_is_taken_over_that_of_a_living_one_is_not(tmp_path: Path) -> None:
    path = tmp_path / "status.sock"
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(path))
    left.close()
    server = LocalServer(path)
    with pytest.raises(OSError, match="another vessel's process"):
        LocalServer(path)
    connect(path, 1.0).close()
    server.close()
    path.write_text("a file of somebody's")
    with pytest.raises(OSError, match="no socket"):
        LocalServer(path)
    assert path.read_text() == "a file of somebody's"


def test_a_picture_survives_json_and_another_versions_fields_are_passed_over() -> None:
    picture = picture_of(snapshot(texts=(LogText(1, 0, Severity.INFO, "Größe"),)))
    data = json.loads(dumps(picture))
    assert from_fields({**data, "of another day": 1}) == picture
    with pytest.raises(NoPictureError, match="not a picture"):
        from_fields({"t_s": "yesterday"})


def test_the_vessel_is_found_by_its_file_its_run_its_socket_or_by_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    vessel = Vessel(tmp_path / "state" / "status.sock")
    boat = tmp_path / "boat.toml"
    boat.write_text('store = "state/companion.db"\n')
    for where in (None, boat, tmp_path / "state", tmp_path / "state" / "status.sock"):
        client, _ = reach(places(where))
        client.close()
    vessel.service.close()
    with pytest.raises(ConfigError, match="no running vessel"):
        reach(places(None))


def test_the_command_shows_the_state_once(vessel: Vessel, capsys: pytest.CaptureFixture[str]) -> None:
    path = vessel.service._server.path
    waiting = Client.poll

    def ticking(self: Client) -> Iterator[dict[str, Any]]:
        vessel.run(5, "the newest alarm")
        return waiting(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Client, "poll", ticking)
        assert main(["status", str(path), "--once"]) == 0
    said = capsys.readouterr().out
    assert "the newest alarm" in said
    assert "item 2 (last: 4)" in said
    assert main(["status", str(path.with_name("nothing"))]) == 2
    assert "No such file" in capsys.readouterr().err

"""The page's parts without a browser: what is read of requests, what is sent and how much, which files are served, the key."""

from __future__ import annotations

import gzip
import json
import os
import random
import re
import socket
import stat
from http import HTTPStatus
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

import config
from companion.cli import main
from companion.io.keeping.keys import page_key_from_passphrase
from companion.status.picture import fields_of, picture_of
from companion.web import http, page
from companion.web.live import BUDGET_BYTES_PER_S, BURST_BYTES, Feed, page_fields
from companion.web.runs import Runs
from companion.web.track import POINTS_MAX, PageTrack
from mavlink_bridge.language.messages import LogText, Severity
from tests.unit.test_status import snapshot

HEAD = b"GET / HTTP/1.1\r\nHost: 10.42.0.1:8080\r\n\r\n"


def refusal(head: bytes) -> HTTPStatus:
    with pytest.raises(http.BadRequestError) as found:
        http.check_host(http.read_head(head), ())
    return found.value.status


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"GET / HTTP/1.1\r\n" + b"X: " + b"y" * http.HEAD_MAX + b"\r\n\r\n", 431),
        (b"GET /" + b"y" * 9000 + b" HTTP/1.1\r\n\r\n", 431),
        (b"GET / HTTP/1.1\r\n" + b"".join(b"X%d: y\r\n" % n for n in range(200)) + b"\r\n", 431),
        (b"DELETE / HTTP/1.1\r\nHost: x\r\n\r\n", 405),
        (b"GET http://elsewhere/ HTTP/1.1\r\nHost: x\r\n\r\n", 400),
        (b"GET / HTTP/9.9\r\nHost: x\r\n\r\n", 505),
        (b"GET /\r\n\r\n", 400),
        (b"\x16\x03\x01\x02\x00\x01\r\n\r\n", 400),
        (b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: 1e3\r\n\r\n", 400),
        (b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n", 400),
        (b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999999999999\r\n\r\n", 413),
        (b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: 2000\r\n\r\n", 413),
        (b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n", 400),
        (b"POST /order HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n", 411),
        (b"GET / HTTP/1.1\r\nHost: boat.elsewhere.example\r\n\r\n", 421),
        (b"GET / HTTP/1.1\r\n\r\n", 421),
    ],
)
def test_what_is_too_long_or_strange_is_refused(head: bytes, status: int) -> None:
    assert refusal(head) == status


@pytest.mark.parametrize(
    "host", ["10.42.0.1:8080", "[fe80::1]:8080", "localhost:8080", "myboat", "myboat.local:80", "boat.example.org"]
)
def test_addresses_local_names_and_named_ones_are_the_boats(host: str) -> None:
    request = http.read_head(b"GET /live?x=1 HTTP/1.1\r\nHost: %b\r\n\r\n" % host.encode())
    http.check_host(request, ("boat.example.org",))
    assert request.path == "/live"


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://elsewhere", "content-type": "application/json"},
        {"content-type": "application/json"},
        {"origin": "http://10.42.0.1:8080", "content-type": "text/plain"},
        {"origin": "http://10.42.0.1:8080", "content-type": "application/json", "sec-fetch-site": "cross-site"},
        {"origin": "null", "content-type": "application/json"},
    ],
)
def test_an_order_of_another_sites_page_is_refused(headers: dict[str, str]) -> None:
    request = http.HttpRequest("POST", "/order", {"host": "10.42.0.1:8080", **headers})
    with pytest.raises(http.BadRequestError):
        http.check_own_page(request)
    own = {"host": "10.42.0.1:8080", "origin": "http://10.42.0.1:8080", "content-type": "application/json"}
    http.check_own_page(http.HttpRequest("POST", "/order", own))


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=300), st.binary(max_size=60))
def test_no_bytes_make_more_than_a_refusal(noise: bytes, more: bytes) -> None:
    for head in (noise, HEAD[:20] + noise + HEAD[20:], b"GET /" + more + b" HTTP/1.1\r\n" + noise + b"\r\n\r\n"):
        try:
            request = http.read_head(head)
        except http.BadRequestError:
            continue
        assert request.method in ("GET", "POST")
        assert 0 <= request.body_bytes <= http.BODY_MAX


def test_a_browser_gets_what_has_changed_within_its_budget() -> None:
    """Five minutes of a boat under way, with a bad spell of long texts: never more than the budget, and the newest always."""
    chance, feed, shown = random.Random(1), Feed(0), {}
    sent, told = 0, []
    for tenth in range(3000):
        t_us = tenth * 100_000
        if 1000 < tenth < 1500:
            told.append(LogText(len(told), t_us, Severity.WARNING, "w" * 120))
        picture = picture_of(snapshot(t_us), tuple(told[-20:]))
        picture.lat_deg = 41.0 + chance.random()
        event = feed.due(page_fields(fields_of(picture)), t_us)
        sent += len(event)
        if event:
            shown |= json.loads(event.removeprefix(b"data: "))
    assert sent <= BURST_BYTES + BUDGET_BYTES_PER_S * 300
    assert shown["t_s"] >= 299.0
    assert shown["texts"][-1][0] == told[-1].number
    assert BUDGET_BYTES_PER_S < 4000.0


def test_a_track_of_days_stays_small_and_keeps_its_ends() -> None:
    track = PageTrack()
    for number in range(200_000):
        track.add(41.0 + number * 1e-5, -8.7, 5.0 if number % 3 else None)
    fields = track.fields()
    assert len(track) <= POINTS_MAX
    assert len(json.dumps(fields)) < 40_000
    assert fields["origin"] == [41.0, -8.7]
    assert fields["points"][-3] == pytest.approx(2e6, rel=0.01)


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    base = tmp_path / "runs"
    for name in ("20260101-120000", "20260102-120000"):
        (base / name).mkdir(parents=True)
        (base / name / "run.json").write_text("{}")
        (base / name / "control.csv").write_text("t_s\n")
    (base / "20260102-120000" / "report.html").write_text("<p>report")
    (base / "20260102-120000" / "companion.db").write_text("a store")
    (base / "20260102-120000" / "secret.key").write_text("a key")
    (base / "20260102-120000" / "etc.json").symlink_to("/etc/passwd")
    os.mkfifo(base / "20260102-120000" / "pipe.csv")
    (base / "linked").symlink_to("/etc")
    (tmp_path / "outside.json").write_text("{}")
    return base


def test_runs_are_listed_newest_first_and_only_what_was_recorded(runs: Path) -> None:
    found = Runs(runs).listed()
    assert [each["name"] for each in found] == ["20260102-120000", "20260101-120000"]
    assert [name for name, _ in found[0]["files"]] == ["control.csv", "report.html", "run.json"]
    assert [each["report"] for each in found] == [True, False]
    assert Runs(runs / "nothing").listed() == []


@pytest.mark.parametrize(
    ("run", "file"),
    [
        ("..", "outside.json"),
        ("20260102-120000", "../../outside.json"),
        ("20260102-120000/..", "20260101-120000"),
        ("20260102-120000", "etc.json"),
        ("20260102-120000", "companion.db"),
        ("20260102-120000", "secret.key"),
        ("20260102-120000", "pipe.csv"),
        ("linked", "passwd"),
        ("%2e%2e", "outside.json"),
        ("", "run.json"),
        ("20260102-120000", ""),
        ("20260102-120000\0", "run.json"),
    ],
)
def test_no_other_file_is_served(runs: Path, run: str, file: str) -> None:
    assert Runs(runs).open(run, file) is None


def test_a_listed_file_is_served(runs: Path) -> None:
    found = Runs(runs).open("20260101-120000", "control.csv")
    assert found is not None
    with os.fdopen(found[0], "rb") as file:
        assert file.read() == b"t_s\n"


def test_the_page_is_small_whole_and_names_no_other_place() -> None:
    made = page.build()
    text = gzip.decompress(made.packed.body).decode()
    assert text.encode() == made.plain.body
    assert len(made.packed.body) < 40_000
    assert re.findall(r"https?://|//[a-z]+\.|@import|url\(|<link|<img| src=", text) == []
    assert "script-src 'sha256-" in made.plain.headers["Content-Security-Policy"]
    assert "emergency stop" not in text.lower()


@pytest.mark.parametrize("bind", ["192.0.2.1", "no-such-boat.invalid"])
def test_an_address_that_is_not_this_computers_is_named_by_its_key(
    bind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["web", str(config.path("sim.toml")), "--vessel", str(tmp_path), "--set", f"page.bind={bind}"]
    assert main([*words, "--set", "page.port=0"]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"page.bind = '{bind}': cannot serve there: ")
    assert said.endswith("; give an address of this computer, or 0.0.0.0 for all\n")


def test_a_port_that_another_listens_on_is_named_by_its_key(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        words = ["web", str(config.path("sim.toml")), "--vessel", str(tmp_path), "--set", f"page.port={port}"]
        assert main(words) == 1
    said = capsys.readouterr().err
    assert said == f"page.port = {port}: cannot serve at 127.0.0.1: Address already in use; choose another page.port\n"


def test_a_key_of_words_is_made_for_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "page.key"
    assert main(["keys", "make", str(path), "--page"]) == 0
    found = re.search(
        r"what to type on the page: ((?:[a-z0-9]{4}-){4}[a-z0-9]{4})$", capsys.readouterr().out, re.MULTILINE
    )
    assert found is not None
    assert path.read_bytes() == page_key_from_passphrase(found[1])
    assert stat.S_IMODE(path.stat().st_mode) == 0o600

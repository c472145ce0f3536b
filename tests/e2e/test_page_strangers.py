"""Strangers at the page's door, while a person gives orders there."""

from __future__ import annotations

import os
import random
import socket

import pytest

from tests.browser import Browser
from tests.e2e.page_hands import live, use_key
from tests.e2e.page_process import Boat

INSTANCE = 63


def raw(port: int, data: bytes, wait_s: float = 10.0) -> bytes:
    """Say something, and return all that comes back."""
    with socket.create_connection(("127.0.0.1", port), wait_s) as stream:
        found = b""
        try:
            stream.sendall(data)
            while more := stream.recv(65_536):
                found += more
        except (ConnectionError, TimeoutError):
            pass
        return found


def request(path: str, method: str = "GET", body: bytes = b"", **headers: str) -> bytes:
    lines = {"Host": "127.0.0.1", "Content-Length": str(len(body)), **headers}
    head = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in lines.items())
    return f"{method} {path} HTTP/1.1\r\n{head}\r\n".encode("latin-1") + body


@pytest.mark.parametrize(
    "path",
    [
        "/runs/../../page.key",
        "/runs/..%2f..%2fpage.key",
        "/runs/20260101-120000/companion.db",
        "//etc/passwd",
        "/../page.key",
        "/runs/20260101-120000/../../page.key",
        "/runs/./20260101-120000/../20260101-120000/status.sock",
        "/page.js",
    ],
)
def test_no_path_leads_outside(boat: Boat, path: str) -> None:
    found = raw(boat.port, request(path))
    assert found.split(b" ")[1] in (b"404", b"400")
    assert (boat.folder / "page.key").read_bytes() not in found


def test_runs_are_downloaded_whole(boat: Boat) -> None:
    found = raw(boat.port, request("/runs/20260101-120000/run.json"))
    head, _, body = found.partition(b"\r\n\r\n")
    assert b"attachment" in head
    assert body == (boat.sim.run_dir / "run.json").read_bytes()


def test_strangers_disturb_neither_the_vessel_nor_the_operators_page(boat: Boat, phone: Browser) -> None:
    """200 connections that never ask, others that ask for ever or too much, another site's orders: the operator's are obeyed."""
    live(phone, boat.url)
    use_key(phone)
    slow = []
    for number in range(200):
        stream = socket.create_connection(("127.0.0.1", boat.port), 10.0)
        stream.sendall(
            [b"", b"GET /", b"GET / HTTP/1.1\r\nX: ", b"POST /order HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\n"][
                number % 4
            ]
        )
        slow.append(stream)
    ticks = rows(boat)
    phone.press("hold")
    phone.until(lambda: phone.text("said").startswith("Hold: obeyed at "), 20.0)
    assert raw(boat.port, request("/", **{"X": "y" * 100_000})).startswith(b"HTTP/1.1 431")
    body = b'{"order":"disarm","nonce":"","response":""}'
    for headers in (
        {"Origin": "http://evil.example"},
        {},
        {"Origin": "http://127.0.0.1", "Sec_Fetch_Site": "cross-site"},
    ):
        told = raw(boat.port, request("/order", "POST", body, Content_Type="application/json", **headers))
        assert told.startswith(b"HTTP/1.1 403")
    own = {"Origin": "http://127.0.0.1", "Content_Type": "application/json"}
    assert b"refused" in raw(boat.port, request("/order", "POST", body, **own))
    assert raw(boat.port, request("/", Host="evil.example")).startswith(b"HTTP/1.1 421")
    fuzz(boat.port, 300, random.Random(7))
    assert phone.text("live") == "live"
    assert rows(boat) > ticks
    phone.press("hold")
    phone.until(lambda: phone.text("said").startswith("Hold: obeyed at "), 20.0)
    for stream in slow:
        stream.close()
    assert boat.web.poll() is None
    assert "Traceback" not in boat.log.read_text()


def rows(boat: Boat) -> int:
    return (boat.sim.run_dir / "control.csv").stat().st_size


def fuzz(port: int, count: int, chance: random.Random) -> None:
    """Requests made of right ones: cut, mixed, with noise, of every route."""
    routes = ["/", "/live", "/map", "/depths", "/runs", "/runs/20260101-120000/run.json", "/challenge", "/order"]
    for _ in range(count):
        data = bytearray(
            request(
                chance.choice(routes),
                chance.choice(["GET", "POST", "PUT", "G\x00T"]),
                chance.choice([b"", b"{}", b"[1", b'{"order":"hold"}', chance.randbytes(40)]),
                **chance.choice(
                    [{}, {"Origin": "http://127.0.0.1", "Content_Type": "application/json"}, {"Connection": "x"}]
                ),
            )
        )
        for _ in range(chance.randrange(4)):
            place = chance.randrange(len(data))
            data[place : place + chance.randrange(8)] = chance.randbytes(chance.randrange(6))
        with socket.create_connection(("127.0.0.1", port), 10.0) as stream:
            stream.settimeout(0.02)
            try:
                stream.sendall(bytes(data[: chance.randrange(len(data) + 1)] if chance.random() < 0.3 else data))
                stream.recv(512)
            except OSError:
                pass


def test_orders_go_one_after_another_by_one_connection_and_all_else_by_its_own(boat: Boat) -> None:
    """A browser gives the first way to the boat to its oldest question: the order behind it waits for no other way."""
    own = {"Origin": "http://127.0.0.1", "Content_Type": "application/json"}
    ask = request("/challenge", "POST", b"{}", **own)
    assert raw(boat.port, ask * 3).count(b'{"challenge":') == 3
    assert raw(boat.port, request("/challenge", "POST", b"{}", Connection="close", **own) * 2).count(b"HTTP/1.1") == 1
    assert raw(boat.port, request("/runs") * 2).count(b"HTTP/1.1") == 1
    assert raw(boat.port, ask + request("/order", "POST", b"{}", Origin="http://evil.example")).endswith(b"page only\n")


@pytest.mark.soak
def test_a_hundred_thousand_fuzzed_requests_change_nothing(boat: Boat, phone: Browser) -> None:
    live(phone, boat.url)
    orders = (boat.sim.run_dir / "events.jsonl").read_text().count('"page"')
    fuzz(boat.port, int(os.environ.get("PAGE_FUZZ", "100000")), random.Random(11))
    assert phone.text("live") == "live"
    assert boat.web.poll() is None
    assert "Traceback" not in boat.log.read_text()
    assert (boat.sim.run_dir / "events.jsonl").read_text().count('"page"') == orders

"""A ground station that connects as QGroundControl does: its sequence, timers and retries, without its windows.

The core holds no socket and no clock: ``receive(data, now_us)``, ``take(now_us) -> bytes``. Times and retry rules are those of
gcs.md §1.1 and §4.1 (QGroundControl master of 2026) and, for what an operator presses (``qgc_buttons.py``), of qgc-real.md, where
QGroundControl 4.3 itself was measured. ``generation`` chooses between the rules of 4.x and 5.x. Runnable by hand with a readable trace::

    python -m tests.qgc_client udp:127.0.0.1:14550        # listens, as QGroundControl does
    python -m tests.qgc_client tcp:127.0.0.1:5760 --upload
"""

from __future__ import annotations

import argparse
import json
import math
import select
import socket
import struct
import time
import zlib
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from tests.qgc_buttons import ARDUPILOT, PLAN_S, Buttons, Generation, _Asked

FENCE, RALLY, FTP = 16384, 32768, 32
NAN = math.nan
_PLANS = {0: "Mission", 1: "GeoFence", 2: "Rally Point"}

Script = Generator[tuple[str, Callable[[Any], bool], float], Any, Any]
"""A step of the sequence: yields (what it waits for, predicate, time-out in s), gets the message or None."""


@dataclass
class Report:
    """What came of the connect."""

    finished_s: float | None = None
    states: list[tuple[str, float]] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    """What QGroundControl would show in a pop-up, or would miss silently."""
    popups: list[str] = field(default_factory=list)
    """Message boxes that an operator has to click away; each is among ``failures`` too."""
    texts: list[tuple[float, int, str]] = field(default_factory=list)
    """STATUSTEXTs as shown: seconds since the vehicle was found, severity, text."""
    params: dict[str, float] = field(default_factory=dict)
    modes: list[str] = field(default_factory=list)
    mode_names: dict[int, str] = field(default_factory=dict)
    """By the number in HEARTBEAT, as the vehicle told them (5.x asks)."""
    plans: dict[int, list[Any]] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)
    resends: int = 0
    answers: list[tuple[int, float]] = field(default_factory=list)
    """Commands that were pressed and answered in time, and after how many seconds."""


class QgcClient(Buttons):
    """One QGroundControl. Starts when it hears a vehicle's HEARTBEAT from component 1."""

    report: Report

    def __init__(
        self,
        system: int = 255,
        component: int = 190,
        say: Callable[[str], None] = lambda line: None,
        generation: Generation = Generation.V5,
    ) -> None:
        self.system, self.component = system, component
        self.generation = generation
        self.mode: int | None = None
        self.armed = False
        self.max_version: int | None = None
        self._outstanding: dict[int, _Asked] = {}
        self._chunks: list[str] = []
        self.codec = Codec(system, component)
        self.deframer = Deframer()
        self.report = Report()
        self.vehicle: int | None = None
        self.autopilot = 0
        self.capabilities: int | None = None
        self._say = say
        self._out = bytearray()
        self._script: Script | None = None
        self._queue: list[Script] = []
        self._wait: Callable[[Any], bool] | None = None
        self._what = ""
        self._deadline_us = 0
        self._next_heartbeat_us: int | None = None
        self._started_us = 0
        self._now_us = 0
        self._ftp_sequence = 0
        self._gimbal_asks = 0
        self.result: Any = None

    # The wire

    def receive(self, data: bytes, now_us: int) -> None:
        self._now_us = now_us
        for frame in self.deframer.receive(data, now_us):
            message = decode(frame)
            if message is not None:
                self._message(message)

    def take(self, now_us: int) -> bytes:
        """Serve the timers and return what is to be sent."""
        self._now_us = now_us
        if self._next_heartbeat_us is None or now_us >= self._next_heartbeat_us:
            self._next_heartbeat_us = now_us + 1_000_000
            self._send(dialect.MAVLink_heartbeat_message(6, 8, 192, 0, 4, 3), quiet=True)
        self._expire(now_us)
        if self._script is not None and now_us >= self._deadline_us:
            self._trace(f"  ... no {self._what}")
            self._advance(None)
        out, self._out = bytes(self._out), bytearray()
        return out

    @property
    def idle(self) -> bool:
        """True when no script runs and a vehicle was connected."""
        return self.vehicle is not None and self._script is None and not self._queue

    def then(self, script: Script) -> None:
        """Run a script once the connect sequence is over."""
        self._queue.append(script)

    def start(self, script: Script) -> None:
        """Run a script after those under way; its return value ends up in ``result``."""
        self._queue.append(script)
        self._next_script()

    def _message(self, message: Any) -> None:
        kind, system = message.get_type(), message.get_srcSystem()
        if kind == "HEARTBEAT" and message.get_srcComponent() == 1:
            self._heard(message, system)
        if system != self.vehicle:
            return
        if kind == "HEARTBEAT" and message.get_srcComponent() == 1:
            self.mode, self.armed = message.custom_mode, bool(message.base_mode & 128)
        if kind == "COMMAND_ACK":
            self._answered(message)
        if kind == "STATUSTEXT":
            self._trace(f"< {kind} {message.severity}: {message.text}")
            self._text(message)
        if self._wait is not None and self._wait(message):
            self._trace(f"< {_short(message)}")
            self._advance(message)

    def _heard(self, message: Any, system: int) -> None:
        if self.vehicle is None:
            self.vehicle, self.autopilot = system, message.autopilot
            self._started_us = self._now_us
            self._trace(
                f"vehicle {system}, autopilot {self.autopilot}, type {message.type}, mode {message.custom_mode}"
            )
            self._queue.insert(0, self._connect())
            self._next_script()
        if self._gimbal_asks < 6:
            self._gimbal_asks += 1
            self._command_long(512, 280)

    def _advance(self, message: Any) -> None:
        assert self._script is not None
        try:
            self._what, self._wait, limit_s = self._script.send(message)
            self._deadline_us = self._now_us + round(limit_s * 1e6)
        except StopIteration as stop:
            self.result, self._script, self._wait = stop.value, None, None
            self._next_script()

    def _next_script(self) -> None:
        if self._script is None and self._queue:
            self._script = self._queue.pop(0)
            self._advance(None)

    def _send(self, message: Any, *, quiet: bool = False) -> None:
        if not quiet:
            self._trace(f"> {_short(message)}")
        self._out += self.codec.encode(message)

    def _trace(self, line: str) -> None:
        self._say(f"{(self._now_us - self._started_us) * 1e-6:8.3f}  {line}")

    def _fail(self, what: str) -> None:
        self._trace(f"!! {what}")
        self.report.failures.append(what)

    def _popup(self, text: str) -> None:
        self._fail(text)
        self.report.popups.append(text)

    def _text(self, message: Any) -> None:
        """Put chunks together as QGroundControl does: a chunk that is not full ends the text."""
        self._chunks.append(message.text)
        if not message.id or len(message.text.encode()) < 50:
            text, self._chunks = "".join(self._chunks), []
            self.report.texts.append(((self._now_us - self._started_us) * 1e-6, message.severity, text))

    def send_message(self, message: Any) -> None:
        """Send a message that no script makes."""
        self._send(message)

    # The connect sequence

    def _connect(self) -> Script:
        for name, state in (
            ("autopilot version", self._version()),
            ("protocol version", self._protocol_version()),
            ("modes", self._modes()),
            ("component metadata", self._metadata()),
            ("parameters", self._parameters()),
            ("mission", self.download(0)),
            ("fence", self._optional(1, FENCE)),
            ("rally", self._optional(2, RALLY)),
        ):
            began_us = self._now_us
            self._trace(f"-- {name}")
            yield from state
            self.report.states.append((name, (self._now_us - began_us) * 1e-6))
        self.report.finished_s = (self._now_us - self._started_us) * 1e-6
        self._trace(f"-- connected in {self.report.finished_s:.3f} s")

    def request_message(
        self, number: int, param2: float = 0.0, wants: Callable[[Any], bool] = lambda m: True
    ) -> Script:
        """REQUEST_MESSAGE: three tries of the command, 1.2 s each, then 1 s for the message after its ACK."""
        known = dialect.mavlink_map.get(number)
        name = known.msgname if known else str(number)
        found: list[Any] = []

        def seen(message: Any) -> bool:
            if message.get_type() == name and wants(message):
                found.append(message)
            return _is_ack(message, 512)

        for confirmation in range(3):
            self._command_long(512, number, param2, confirmation=confirmation)
            self.report.resends += confirmation > 0
            ack = yield (f"answer to REQUEST_MESSAGE({name})", seen, 1.2)
            if ack is not None:
                break
        else:
            return None
        if ack.result != 0:
            return None
        if found:
            return found[0]
        message = yield (name, lambda m: m.get_type() == name and wants(m), 1.0)
        return message

    def _version(self) -> Script:
        version = yield from self.request_message(148)
        if version is None:
            self._fail("no AUTOPILOT_VERSION")
        self.capabilities = version.capabilities if version else None

    def _protocol_version(self) -> Script:
        if self.generation.asks_protocol_version:
            version = yield from self.request_message(300)
            self.max_version = version.max_version if version else None

    def _modes(self) -> Script:
        if not self.generation.asks_modes:
            return
        index, count = 1, 1
        while index <= count:
            mode = yield from self.request_message(435, index, _has_index(index))
            if mode is None:
                self._fail(f"no AVAILABLE_MODES {index}")
                return
            count = mode.number_modes
            self.report.modes.append(mode.mode_name)
            self.report.mode_names[mode.custom_mode] = mode.mode_name
            index += 1

    def _metadata(self) -> Script:
        answer = yield from self.request_message(397)
        if answer is None:
            yield from self.request_message(395)
            return
        general = yield from self.ftp_download(answer.uri.removeprefix("mftp://"))
        if general is None or _crc(general) != answer.file_crc:
            self._fail("component metadata: no general file, or its CRC is wrong")
            return
        for entry in json.loads(general)["metadataTypes"]:
            data = yield from self.ftp_download(entry["uri"].removeprefix("mftp://"))
            if data is None or _crc(data) != entry["fileCrc"]:
                self._fail(f"component metadata: {entry['uri']}")
            else:
                self.report.metadata[entry["uri"]] = json.loads(data)

    def _parameters(self) -> Script:
        if self.autopilot == ARDUPILOT:
            packed = yield from self.ftp_download("@PARAM/param.pck?withdefaults=1")
            if packed is not None:
                self.report.params = _unpack(packed)
                self._check_expected()
                return
        values: dict[int, Any] = {}
        for attempt in range(5):
            self.report.resends += attempt > 0
            self._send(dialect.MAVLink_param_request_list_message(self.vehicle, 0))
            first = yield ("first PARAM_VALUE", lambda m: m.get_type() == "PARAM_VALUE", 5.0)
            if first is not None:
                values[first.param_index] = first
                break
        else:
            self._fail("parameter download failed")
            return
        yield from self._fill(values, first.param_count)
        self.report.params = {value.param_id: value.param_value for value in values.values()}
        self._send(dialect.MAVLink_system_time_message(0, 0))
        self._send(dialect.MAVLink_system_time_message(0, 0))

    def _fill(self, values: dict[int, Any], count: int) -> Script:
        """Collect the list; after 3 s of silence ask for missing ones by index, ten at a time, five tries each."""
        tries: dict[int, int] = {}
        while len(values) < count:
            value = yield ("PARAM_VALUE", lambda m: m.get_type() == "PARAM_VALUE" and m.param_index < 65535, 3.0)
            if value is not None:
                values[value.param_index] = value
                continue
            missing = [index for index in range(count) if index not in values][:10]
            for index in missing:
                tries[index] = tries.get(index, 0) + 1
                if tries[index] > 5:
                    self._fail(f"parameter {index} never came")
                    return
                self.report.resends += 1
                self._send(dialect.MAVLink_param_request_read_message(self.vehicle, 1, b"", index))

    def _check_expected(self) -> None:
        for name in (
            "RCMAP_ROLL",
            "RC1_MIN",
            "RC1_MAX",
            "RC1_TRIM",
            "COMPASS_DEV_ID",
            "COMPASS_USE",
            "COMPASS_OFS_X",
            "INS_ACCOFFS_X",
        ):
            if name not in self.report.params:
                self._fail(f"parameter missing from firmware: {name}")

    def _optional(self, kind: int, bit: int) -> Script:
        is_old = self.generation.asks_protocol_version and self.autopilot != ARDUPILOT and (self.max_version or 0) < 200
        if is_old:
            self._fail(f"plans of kind {kind} are greyed out: taken for MAVLink 1")
        elif self.capabilities is not None and self.capabilities & bit:
            yield from self.download(kind)

    # Plans

    def download(self, kind: int) -> Script:
        """MISSION_REQUEST_LIST, 1.5 s; items one by one, 250 ms; five retries each, then a pop-up."""
        count = None
        for attempt in range(6):
            self.report.resends += attempt > 0
            self._send(dialect.MAVLink_mission_request_list_message(self.vehicle, 1, kind))
            count = yield ("MISSION_COUNT", lambda m: m.get_type() == "MISSION_COUNT" and m.mission_type == kind, 1.5)
            if count is not None:
                break
        if count is None:
            self._fail(f"no plan of kind {kind}")
            return None
        items: list[Any] = []
        while len(items) < count.count:
            item = yield from self._item(kind, len(items))
            if item is None:
                self._fail(f"item {len(items)} of kind {kind} never came")
                return None
            items.append(item)
        self._send(dialect.MAVLink_mission_ack_message(self.vehicle, 1, 0, kind))
        self.report.plans[kind] = items
        return items

    def _item(self, kind: int, seq: int) -> Script:
        for attempt in range(6):
            self.report.resends += attempt > 0
            self._send(dialect.MAVLink_mission_request_int_message(self.vehicle, 1, seq, kind))
            item = yield (
                f"item {seq}",
                lambda m: m.get_type() == "MISSION_ITEM_INT" and m.seq == seq and m.mission_type == kind,
                0.25,
            )
            if item is not None:
                return item
        return None

    def upload(self, kind: int, items: list[tuple[Any, ...]]) -> Script:
        """MISSION_COUNT (six times 1.5 s), then each item as it is asked for; silence after the first item ends it.

        An empty plan has no first item to be asked for, so its one MISSION_COUNT waits for the final acknowledgement like a last item.

        Returns the MISSION_ACK type, None when it gave up.

        Each item is (frame, command, p1, p2, p3, p4, x, y, z).
        """
        counts = 0
        began = last = False
        while True:
            if not began:
                self.report.resends += counts > 0
                counts += 1
                self._send(dialect.MAVLink_mission_count_message(self.vehicle, 1, len(items), kind))
            message = yield ("request or ack", lambda m: _is_plan_talk(m, kind), PLAN_S)
            if message is None:
                if last or not items:
                    self._popup(f"{_PLANS[kind]} transfer failed. Error: Mission write failed, no final ack.")
                    return None
                if began or counts > 5:
                    self._popup(f"{_PLANS[kind]} transfer failed. Error: vehicle does not go on")
                    return None
                continue
            if message.get_type() == "MISSION_ACK":
                return message.type
            began = True
            last = message.seq == len(items) - 1
            if message.seq < len(items):
                frame, command, p1, p2, p3, p4, x, y, z = items[message.seq]
                self._send(
                    dialect.MAVLink_mission_item_int_message(
                        self.vehicle,
                        1,
                        message.seq,
                        frame,
                        command,
                        int(message.seq == 0),
                        1,
                        p1,
                        p2,
                        p3,
                        p4,
                        x,
                        y,
                        z,
                        kind,
                    )
                )

    # Commands and parameters

    def _command_long(self, command: int, *params: float, confirmation: int = 0) -> None:
        values = [*params, *([0.0] * (7 - len(params)))]
        self._send(dialect.MAVLink_command_long_message(self.vehicle, 1, command, confirmation, *values))

    def command(self, number: int, *params: float) -> Script:
        """Any other command: sent once, 1.2 s (4.x: 3 s), each IN_PROGRESS starts the wait anew. Returns the result or None."""
        self._command_long(number, *params)
        while True:
            ack = yield (f"answer to command {number}", lambda m: _is_ack(m, number), self.generation.answer_s)
            if ack is None:
                self._fail(f"vehicle did not respond to command {number}")
                return None
            if ack.result != 5:
                return ack.result

    def set_param(self, name: str, value: float) -> Script:
        """PARAM_SET, 1 s, two retries; the echo must agree in name, type and value. Returns True, or the PARAM_ERROR."""
        wire = struct.unpack("<f", struct.pack("<f", value))[0]
        for attempt in range(3):
            self.report.resends += attempt > 0
            self._send(dialect.MAVLink_param_set_message(self.vehicle, 1, name.encode(), value, 9))
            echo = yield (
                f"echo of {name}",
                lambda m: m.get_type() in ("PARAM_VALUE", "PARAM_ERROR") and m.param_id == name,
                1.0,
            )
            if echo is not None and echo.get_type() == "PARAM_ERROR":
                if self.generation.knows_param_error:
                    return echo.error
                echo = None
            if echo is not None and echo.param_value == wire and echo.param_type == 9:
                return True
        return None

    # Files

    def ftp_download(self, path: str) -> Script:
        """Open, burst with gaps filled by reads, terminate; 1 s and three retries for each request."""
        opened = yield from self._ftp(4, 0, 0, path.lstrip("/").encode() if not path.startswith("@") else path.encode())
        if opened is None or opened.op != 128:
            return None
        size, session = struct.unpack("<I", opened.data)[0], opened.session
        parts: dict[int, bytes] = {}
        while sum(map(len, parts.values())) < size:
            offset = _first_gap(parts)
            reply = yield from self._ftp(15, session, offset, b"", 239)
            if reply is None or reply.op != 128:
                return None
            while reply is not None and reply.op == 128:
                parts[reply.offset] = reply.data
                if reply.complete:
                    break
                message = yield ("burst", self._is_file, 1.0)
                reply = None if message is None else _FileReply(message)
        yield from self._ftp(1, session, 0, b"")
        return b"".join(parts[at] for at in sorted(parts))

    def _is_file(self, message: Any) -> bool:
        return message.get_type() == "FILE_TRANSFER_PROTOCOL" and message.target_system in (0, self.system)

    def _ftp(self, op: int, session: int, offset: int, data: bytes, size: int | None = None) -> Script:
        self._ftp_sequence = (self._ftp_sequence + 100) & 0xFFFF
        header = struct.pack(
            "<HBBBBBxI", self._ftp_sequence, session, op, len(data) if size is None else size, 0, 0, offset
        )
        for attempt in range(4):
            self.report.resends += attempt > 0
            self._send(
                dialect.MAVLink_file_transfer_protocol_message(
                    0, self.vehicle, 1, list((header + data).ljust(251, b"\0"))
                )
            )
            message = yield (f"file reply to {op}", lambda m: self._is_file(m) and _FileReply(m).asked == op, 1.0)
            if message is not None:
                return _FileReply(message)
        self._fail(f"file request {op} was not answered")
        return None


class _FileReply:
    def __init__(self, message: Any) -> None:
        raw = bytes(message.payload)
        self.sequence, self.session, self.op, size, self.asked, self.complete, self.offset = struct.unpack_from(
            "<HBBBBBxI", raw
        )
        self.data = raw[12 : 12 + size]


def _first_gap(parts: dict[int, bytes]) -> int:
    at = 0
    while at in parts:
        at += len(parts[at])
    return at


def _has_index(index: int) -> Callable[[Any], bool]:
    return lambda message: bool(message.mode_index == index)


def _is_ack(message: Any, command: int) -> bool:
    """QGroundControl goes by component and command alone."""
    return bool(message.get_type() == "COMMAND_ACK" and message.command == command)


def _is_plan_talk(message: Any, kind: int) -> bool:
    return (
        message.get_type() in ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK") and message.mission_type == kind
    )


def _crc(data: bytes) -> int:
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def _unpack(data: bytes) -> dict[str, float]:
    """Read param.pck."""
    magic, count, _ = struct.unpack_from("<HHH", data)
    assert magic in (0x671B, 0x671C)
    values: dict[str, float] = {}
    at, name = 6, b""
    while at < len(data):
        if data[at] == 0:
            at += 1
            continue
        has_default, common, rest = data[at] >> 4 & 1, data[at + 1] & 15, (data[at + 1] >> 4) + 1
        name = name[:common] + data[at + 2 : at + 2 + rest]
        at += 2 + rest
        values[name.decode()] = struct.unpack_from("<f", data, at)[0]
        at += 8 if has_default else 4
    assert len(values) == count
    return values


def _short(message: Any) -> str:
    hidden = {"target_system", "target_component", "payload", "target_network"}
    fields = " ".join(f"{name}={getattr(message, name)}" for name in message.get_fieldnames() if name not in hidden)
    return f"{message.get_type()} {fields}"[:150]


# By hand


class _Wire:
    """A UDP port that listens as QGroundControl does, or a TCP client."""

    def __init__(self, where: str) -> None:
        kind, host, port = where.split(":")
        self._udp = kind == "udp"
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM if self._udp else socket.SOCK_STREAM)
        self._peer: Any = None
        if self._udp:
            self.socket.bind((host, int(port)))
        else:
            self.socket.connect((host, int(port)))

    def read(self, timeout_s: float) -> bytes:
        if not select.select([self.socket], [], [], timeout_s)[0]:
            return b""
        data, peer = self.socket.recvfrom(65536)
        self._peer = peer or self._peer
        return data

    def write(self, data: bytes) -> None:
        if not self._udp:
            self.socket.sendall(data)
        elif self._peer is not None:
            self.socket.sendto(data, self._peer)


def run(where: str, client: QgcClient, limit_s: float = 60.0) -> Report:
    """Connect over a socket and return what came of it."""
    wire = _Wire(where)
    began = time.monotonic()
    try:
        while time.monotonic() - began < limit_s:
            now_us = round((time.monotonic() - began) * 1e6)
            client.receive(wire.read(0.01), now_us)
            data = client.take(now_us)
            if data:
                wire.write(data)
            if client.idle:
                break
    finally:
        wire.socket.close()
    return client.report


def main() -> None:
    parser = argparse.ArgumentParser(description="Connect to a vehicle as QGroundControl does and say what happens.")
    parser.add_argument("where", help="udp:HOST:PORT to listen, tcp:HOST:PORT to connect")
    parser.add_argument("--upload", action="store_true", help="afterwards upload a small mission and read it back")
    arguments = parser.parse_args()
    client = QgcClient(say=print)
    if arguments.upload:
        items = [(3, 16, 0.0, 0.0, 0.0, NAN, 411_850_000, -87_060_000 + 1000 * number, 50.0) for number in range(5)]
        client.then(client.upload(0, items))
        client.then(client.download(0))
    report = run(arguments.where, client)
    print(
        json.dumps(
            {
                "finished_s": report.finished_s,
                "failures": report.failures,
                "parameters": len(report.params),
                "modes": report.modes,
                "resends": report.resends,
            },
            indent=1,
        )
    )


if __name__ == "__main__":
    main()

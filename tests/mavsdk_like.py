"""A ground station with MAVSDK's habits, in virtual time: asks again after half a second, and talks of several things at once.

Counted on MAVSDK 4.1: HEARTBEAT once a second; a command is sent four times 0.5 s apart, then it has failed; an upload's or download's last
message six times. While it gets to know a vehicle it asks for messages and rates by commands of their own.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer

REPEAT_US = 500_000
COMMAND_SENDS = 4
ITEM_SENDS = 6
PAUSE_US = 500_000
CHATTER = ((512, 148.0), (511, 242.0), (520, 1.0), (512, 397.0))
"""Commands of the first seconds, with their first parameter."""

Job = Generator[tuple[Any, tuple[str, ...], Any, int], Any, bool]
"""Yields (message to send, names awaited, predicate, sends allowed); gets the answer or None; returns whether it worked."""


@dataclass
class _Task:
    job: Job
    what: str
    message: Any = None
    wants: tuple[tuple[str, ...], Any] = ((), None)
    sends_left: int = 0
    due_us: int = 0
    done: bool | None = None


@dataclass
class MavsdkLike:
    """``receive`` and ``take`` like any endpoint. ``plan``: items of an upload; the steps run one after the other, each tried again."""

    plan: list[tuple[Any, ...]]
    phase_us: int = 0
    tries: int = 20
    target: int = 1
    codec: Codec = field(default_factory=lambda: Codec(245, 190))
    deframer: Deframer = field(default_factory=Deframer)
    log: list[tuple[float, str]] = field(default_factory=list)
    read_back: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._beat_us = self.phase_us
        self._out: deque[Any] = deque()
        self._chatter = [_Task(self._command(number, value), f"chatter {number}") for number, value in CHATTER]
        self._steps = deque(("upload", "download", "arm", "mode", "start"))
        self._step: _Task | None = None
        self._step_from_us = 0
        self._tries = 0
        self._met = False

    @property
    def finished(self) -> bool:
        return not self._steps and self._step is None

    # ---- bytes --------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, now_us: int) -> None:
        for frame in self.deframer.receive(data, now_us):
            message = decode(frame)
            if message.get_type() == "HEARTBEAT" and not self._met:
                self._met, self._step_from_us = True, now_us
            for task in self._running():
                if message.get_type() in task.wants[0] and task.wants[1](message):
                    self._advance(task, message, now_us)
                    break

    def take(self, now_us: int) -> bytes:
        if now_us >= self._beat_us:
            self._beat_us += 1_000_000
            self._out.append(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        if self._met:
            self._begin(now_us)
            for task in self._running():
                self._repeat(task, now_us)
        data = b"".join(self.codec.encode(message) for message in self._out)
        self._out.clear()
        return data

    # ---- tasks --------------------------------------------------------------------------------------------------

    def _running(self) -> list[_Task]:
        tasks = [*self._chatter[:2], *([self._step] if self._step else [])]
        return [task for task in tasks if task.done is None]

    def _begin(self, now_us: int) -> None:
        self._chatter = [task for task in self._chatter if task.done is None]
        if self._step is not None and self._step.done is not None:
            self.log.append((now_us * 1e-6, f"{self._step.what} {'done' if self._step.done else 'failed'}"))
            if self._step.done or self._tries >= self.tries:
                self._steps.popleft()
                self._tries = 0
                self._step_from_us = now_us
            else:
                self._step_from_us = now_us + PAUSE_US
            self._step = None
        if self._step is None and self._steps and now_us >= self._step_from_us:
            self._tries += 1
            self._step = _Task(self._job(self._steps[0]), self._steps[0])
        for task in self._running():
            if task.message is None:
                self._advance(task, None, now_us)

    def _advance(self, task: _Task, message: Any, now_us: int) -> None:
        try:
            asked, name, right, sends = task.job.send(message) if task.message is not None else next(task.job)
        except StopIteration as end:
            task.done = bool(end.value)
            return
        task.message, task.wants, task.sends_left, task.due_us = asked, (name, right), sends, now_us

    def _repeat(self, task: _Task, now_us: int) -> None:
        if now_us < task.due_us:
            return
        if task.sends_left == 0:
            self._advance(task, None, now_us)
            return
        task.sends_left -= 1
        task.due_us = now_us + REPEAT_US
        self._out.append(task.message)

    # ---- what it asks -------------------------------------------------------------------------------------------

    def _job(self, step: str) -> Job:
        if step == "upload":
            return self._upload()
        if step == "download":
            return self._download()
        return {
            "arm": lambda: self._command(400, 1.0),
            "mode": lambda: self._command(176, 1.0, 10.0),
            "start": lambda: self._command(300),
        }[step]()

    def _command(self, number: int, *params: float) -> Job:
        values = [*params, *([0.0] * (7 - len(params)))]
        message = dialect.MAVLink_command_long_message(self.target, 1, number, 0, *values)
        answer = yield message, ("COMMAND_ACK",), lambda ack: ack.command == number and ack.result != 5, COMMAND_SENDS
        return answer is not None and answer.result == 0

    def _upload(self) -> Job:
        message: Any = dialect.MAVLink_mission_count_message(self.target, 1, len(self.plan), 0)
        wanted = 0
        while True:
            answer = yield (
                message,
                ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"),
                lambda _: True,
                ITEM_SENDS,
            )
            if answer is None:
                return False
            if answer.get_type() == "MISSION_ACK":
                return answer.type == 0
            wanted = answer.seq
            frame, command, *params = self.plan[wanted]
            message = dialect.MAVLink_mission_item_int_message(self.target, 1, wanted, frame, command, 0, 1, *params, 0)

    def _download(self) -> Job:
        message: Any = dialect.MAVLink_mission_request_list_message(self.target, 1, 0)
        answer = yield message, ("MISSION_COUNT",), lambda _: True, ITEM_SENDS
        if answer is None:
            return False
        self.read_back = []
        for seq in range(answer.count):
            message = dialect.MAVLink_mission_request_int_message(self.target, 1, seq, 0)
            item = yield message, ("MISSION_ITEM_INT",), lambda item, seq=seq: item.seq == seq, ITEM_SENDS
            if item is None:
                return False
            self.read_back.append(item)
        self._out.append(dialect.MAVLink_mission_ack_message(self.target, 1, 0, 0))
        return True

"""The actuator board as the vessel sees it: start-up, refresh, and every way in which it can fail.

A state machine without I/O. On open it says nothing until the board's banner came or 2.5 s passed (boards reset when a port opens),
then sends neutral before anything else, asks the version, and from then on repeats all four commands at the configured rate
whether they changed or not. A board that answers in checked lines is on level 1. Silence is no answer: a mute line is asked for ever
and never armed. Level 0, which never checks nor stops by itself, is the owner's choice, and arms where a person has seen its outputs
move. Nothing is queued: what a blocked port did not take is dropped and counted.
Reference: firmware-reliability §A.5 and §C rows 8-20, dune-imc §1.2 (U1-U9).
"""

from __future__ import annotations

from enum import Enum
from typing import Final

from mavlink_bridge.language.messages import ActuatorOutput, ActuatorStatus, Severity

from . import times, wire
from .actuator_map import ActuatorConfig, ChannelConfig, PulseMap, pulses_to_demand
from .announce import FaultNews
from .health import EMERGENCY, Agreement, LineQuality, PortFlow, reported
from .texts import REASONS, rate_text, started_text
from .wire import Microseconds

__all__ = ["ActuatorConfig", "Arduino", "ChannelConfig", "PulseMap", "pulses_to_demand"]


class BoardPhase(Enum):
    CLOSED = "closed"
    STARTING = "starting"
    ASKING = "asking"
    RUNNING = "running"


CLOSED, STARTING, ASKING, RUNNING = BoardPhase.CLOSED, BoardPhase.STARTING, BoardPhase.ASKING, BoardPhase.RUNNING
_CHECKED: Final = wire.STATE_NAMES["C"]
_READY: Final = (True, "")


class Arduino:
    """One actuator board on one port. Every method takes the vessel's monotonic time, µs."""

    def __init__(self, config: ActuatorConfig, rudder_max_rad: float, *, seen: bool = False) -> None:
        """``rudder_max_rad``: rudder angle at the servos' outer pulses, of the hull file.

        ``seen``: a person has seen this board's outputs move, or it is a simulated one; counts on level 0 only.
        """
        self._rudder_max_rad, self._seen = rudder_max_rad, seen
        self.overruns = 0
        """Commands that were due and not sent because a cycle came late."""
        self._texts: list[tuple[Severity, str]] = []
        self._flow = PortFlow()
        self._down()
        self._work_out(config)

    def _down(self) -> None:
        self._phase = CLOSED
        self._since_us = 0
        self._reader = wire.BoardLineReader()
        self._quality = LineQuality()
        self._agreement = Agreement()
        self._level: int | None = None
        self.version: wire.Version | None = None
        self._protocol: int | None = None
        self._status: wire.Status | None = None
        self._status_us: int | None = None
        self._foreign_us: int | None = None
        self._reset_cause: str | None = None
        self._reset_us: int | None = None
        self._commanded: Microseconds | None = None
        self._neutral_left = times.NEUTRAL_FRAMES
        self._asked_us: int | None = None
        self._first_asked_us: int | None = None
        self._due_us: int | None = None
        self._offered = self._repair = self._repaired = b""
        self._news = FaultNews()
        self._faults: tuple[int, tuple[str, ...]] | None = None
        self._frame_of: tuple[Microseconds, int | None] | None = None
        self._frame_bytes = b""
        self._account: ActuatorStatus | None = None

    def configure(self, config: ActuatorConfig) -> None:
        """Take new settings at once. A new rate is announced with what it costs; a new level holds from the next open."""
        if config.frequency_hz != self.config.frequency_hz:
            self._texts.append(rate_text(config))
        self._work_out(config)
        self._due_us = None
        self._frame_of = None

    def _work_out(self, config: ActuatorConfig) -> None:
        """What every tick needs of the settings."""
        self.config = config
        self._map = PulseMap(config, self._rudder_max_rad)
        self._period_us = round(1e6 / config.frequency_hz)
        self._early_us = self._period_us // 4
        self._too_slow = config.too_slow
        self._silence_ms = config.silence_ms
        self._checks = config.level != "0"

    def opened(self, now_us: int) -> None:
        """The port opened; the board may be restarting because of it."""
        self._down()
        self._flow.note(0, 0, now_us)
        self._phase = STARTING
        self._since_us = now_us

    def closed(self, now_us: int) -> None:
        """The port went away."""
        if self._phase is not CLOSED:
            self._texts.append((Severity.CRITICAL, "Actuator port lost"))
        self._down()

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes from the board. Anything that is not a valid line only counts."""
        if self._phase is CLOSED:
            return
        self._faults = self._account = None
        reader = self._reader
        good, bad, foreign = reader.good, reader.bad, reader.foreign
        for line in reader.receive(data):
            self._take(line, now_us)
        if reader.foreign != foreign:
            self._foreign_us = now_us
        if self._level == 1:
            self._quality.heard(reader.good - good, reader.bad - bad)

    def _changed(self) -> None:
        """What was worked out before no longer holds."""
        self._faults = None
        self._account = None

    def _take(self, line: wire.BoardLine, now_us: int) -> None:
        if self._level != 1 and self._checks:
            self._level = 1
        if isinstance(line, wire.Status):
            self._take_status(line, now_us)
        elif isinstance(line, wire.Version):
            self.version, self._protocol = line, line.protocol
        else:
            self._protocol = line.protocol
            self._reset_cause = line.reset_cause
            self._restarted(now_us)

    def _take_status(self, line: wire.Status, now_us: int) -> None:
        before = self._status
        if before is not None and (line.good < before.good or (before.strict and not line.strict)):
            self._restarted(now_us)
        self._status, self._status_us = line, now_us
        self._reset_cause = line.reset_cause
        self._quality.reported(line.good, line.bad)
        self._agreement.applied(line.applied_us, now_us)

    def _restarted(self, now_us: int) -> None:
        """The board began anew: neutral first again. While it ran for us this is a fault."""
        if self._phase is RUNNING:
            self._reset_us = now_us
            self._texts.append((Severity.CRITICAL, f"Actuator board restarted ({self._reset_cause or 'unknown'})"))
        if self._phase is not STARTING:
            self._begin(now_us)
        self._status, self.version = None, None
        self._quality.forget_board()

    def _begin(self, now_us: int) -> None:
        self._changed()
        self._phase = ASKING
        self._since_us = now_us
        self._neutral_left = times.NEUTRAL_FRAMES
        self._asked_us = self._first_asked_us = self._due_us = None

    def encode(self, output: ActuatorOutput, now_us: int) -> bytes:
        """Return what to write in this tick; call every tick. Empty while the board starts or nothing is due."""
        faults = () if self._phase is CLOSED else self.faults(now_us)
        if faults or self._news.shown:
            self._texts += self._news.look(faults, now_us, self._sentence)
        if self._phase is RUNNING:
            data = self._refresh(output, now_us)
        elif self._phase is CLOSED or not self._awake(now_us):
            return b""
        else:
            data = self._negotiate(now_us)
        if data:
            self._repaired, self._repair = self._repair, b""
            self._offered = data = self._repaired + data
        return data

    def _awake(self, now_us: int) -> bool:
        if self._phase is STARTING:
            if self._reader.good == 0 and now_us - self._since_us < times.BANNER_WAIT_US:
                return False
            self._begin(now_us)
        return True

    def _negotiate(self, now_us: int) -> bytes:
        data = self._frame(self._map.neutral_us, now_us)
        self._neutral_left = max(self._neutral_left - 1, 0)
        if self.config.level == "0":
            self._level = 0
        elif self._asked_us is None or now_us - self._asked_us >= times.ASK_EVERY_US:
            self._asked_us = now_us
            if self._first_asked_us is None:
                self._first_asked_us = now_us
            data += wire.checked(wire.VERSION_QUERY)
        if self._neutral_left == 0 and self._answered(now_us):
            self._phase = RUNNING
            self._changed()
            self._texts.append(started_text(self._level, self.version))
            if self.config.frequency_hz < 2.0:
                self._texts.append(rate_text(self.config))
        return data

    def _answered(self, now_us: int) -> bool:
        if self._level == 0 or self._level is None:
            return self._level == 0
        if self._is_other:
            return False
        # A board that reports and does not tell its version, as where its answers are cut, is taken after a while.
        return self.version is not None or (self._has_waited(now_us) and self.config.level != "1")

    def _refresh(self, output: ActuatorOutput, now_us: int) -> bytes:
        neutral = self._map.neutral_us
        fresh = 0 <= now_us - output.t_us <= times.STALE_OUTPUT_US
        pulses = self._map.pulses(output) if fresh else neutral
        stop_now = pulses == neutral and self._commanded != neutral
        if not self._due(now_us) and not stop_now:
            return b""
        data = self._frame(pulses, now_us)
        if self._level == 1 and (self.version is None or self.version.silence_ms != self._silence_ms):
            data += self._maintenance(now_us)
        return data

    def _due(self, now_us: int) -> bool:
        """Is a repeat due? The schedule keeps its phase; a late cycle skips what is past and counts it."""
        due_us = now_us if self._due_us is None else self._due_us
        if now_us < due_us - self._early_us:
            return False
        missed = (now_us - due_us) // self._period_us if now_us > due_us else 0
        self.overruns += missed
        self._due_us = due_us + (missed + 1) * self._period_us
        return True

    def _frame(self, pulses: Microseconds, now_us: int) -> bytes:
        if self._level == 0 and pulses != self._commanded:
            self._account = None
        self._commanded = pulses
        self._agreement.commanded(pulses, now_us)
        self._quality.sample(now_us)
        if self._frame_of != (pulses, self._level):
            self._frame_of = (pulses, self._level)
            if self._level == 1:
                self._frame_bytes = wire.encode_level1(pulses, batch=self.config.batch)
            else:
                self._frame_bytes = wire.encode_level0(pulses, self.config.level0_terminator)
        return self._frame_bytes

    def _maintenance(self, now_us: int) -> bytes:
        """Have the board's silence limit set as configured; asks again until the board confirms it."""
        if self._asked_us is not None and now_us - self._asked_us < times.ASK_EVERY_US:
            return b""
        self._asked_us = now_us
        return wire.silence_word(self._silence_ms) + wire.checked(wire.VERSION_QUERY)

    def note_written(self, accepted: int, offered: int, now_us: int) -> None:
        """Say how much of the last ``encode`` the port took. The rest is dropped; the next one repairs a cut line."""
        if accepted < offered or self._flow.held_since_us is not None:
            self._flow.note(accepted, offered, now_us)
        if accepted >= offered:
            return
        self._faults = None
        if accepted < len(self._repaired) or accepted <= 0:
            self._repair = self._repaired[max(accepted, 0) :]
        elif self._level == 1:
            self._repair = b"" if self._offered[accepted - 1 : accepted] == b"\n" else b"\n"
        else:
            rest = self._offered[accepted:]
            starts = [index for index, byte in enumerate(rest) if byte in b"mMlL#"]
            self._repair = rest[: starts[0]] if starts else rest

    @property
    def dropped(self) -> int:
        """Frames that the port did not take whole."""
        return self._flow.dropped

    @property
    def commanded_us(self) -> Microseconds | None:
        """The pulses of the last command, pin order; None before the first."""
        return self._commanded

    @property
    def status(self) -> ActuatorStatus:
        """The board's own account, as of its last status line."""
        if self._account is None:
            self._account = self._tell()
        return self._account

    def _tell(self) -> ActuatorStatus:
        line = self._status
        connected = self._phase is not CLOSED
        if line is None:
            state = self._phase.value
            return ActuatorStatus(
                self._status_us or 0,
                connected,
                self._level,
                state,
                commanded_us=self._commanded if self._level == 0 else None,
                reset_cause=self._reset_cause,
            )
        return reported(line, self._status_us or 0, self._level, connected=connected)

    @property
    def damaged(self) -> int:
        """Damaged lines on the way here and, as the board counts them, on the way there."""
        return self._reader.bad + (self._status.bad if self._status else 0)

    def faults(self, now_us: int) -> tuple[str, ...]:
        """Names of what is wrong now (keys of REASONS)."""
        known = self._faults
        if known is None or known[0] != now_us:
            known = self._faults = (now_us, self._look(now_us))
        return known[1]

    def _look(self, now_us: int) -> tuple[str, ...]:
        phase = self._phase
        if phase is CLOSED:
            return ("lost",)
        found: list[str] = []
        if self._flow.held_since_us is not None and self._flow.blocked(now_us):
            found.append("blocked")
        if self._reader.good == 0 and self._reader.garbled:
            found.append("baud")
        elif phase is ASKING and self._level is None and self._has_waited(now_us):
            found.append("foreign" if self._speaks_foreign(now_us) else "mute")
        if self._is_other:
            found.append("protocol")
        if phase is RUNNING and self._level == 1:
            self._look_closer(found, now_us)
        if self._reset_us is not None and now_us - self._reset_us < times.RESET_SHOWN_US:
            found.append("reset")
        if self._status is not None and self._status.state == EMERGENCY:
            found.append("estop")
        return (*found, "level0") if phase is RUNNING and self._level == 0 else tuple(found)

    def _speaks_foreign(self, now_us: int) -> bool:
        return self._foreign_us is not None and now_us - self._foreign_us <= times.SILENT_AFTER_US

    @property
    def _is_other(self) -> bool:
        """Whether the board said that it speaks another protocol; on level 0 nothing that it says counts."""
        return self._level == 1 and self._protocol is not None and self._protocol != wire.PROTOCOL

    def _has_waited(self, now_us: int) -> bool:
        return self._first_asked_us is not None and now_us - self._first_asked_us >= times.ANSWER_WAIT_US

    def _look_closer(self, found: list[str], now_us: int) -> None:
        """What only a board that reports can be found to do."""
        heard_us, status, quality = self._status_us, self._status, self._quality
        if heard_us is None or heard_us < self._since_us:
            heard_us = self._since_us
        state = "" if status is None else status.state
        if now_us - heard_us > times.SILENT_AFTER_US:
            found.append("foreign" if self._speaks_foreign(now_us) else "silent")
        elif state == "failsafe":
            found.append("failsafe")
        elif state != EMERGENCY and self._agreement.disagrees(now_us):
            found.append("mismatch")
        if quality.bad and quality.recent(now_us) and "foreign" not in found:
            if quality.garbage(now_us):
                found.append("garbage")
            if quality.noisy(now_us):
                found.append("noise")

    def ready(self, now_us: int) -> tuple[bool, str]:
        """May the gate give thrust? False comes with one plain sentence."""
        for fault in self.faults(now_us):
            if fault == "noise" or (fault == "level0" and self._seen):
                continue
            return False, self._sentence(fault)
        if self._phase is STARTING:
            return False, "waiting for the actuator board to start"
        if self._phase is ASKING:
            return False, "waiting for the actuator board's version"
        if self._level == 0:
            return _READY
        if self._status is None or self._status.state != _CHECKED:
            return False, f"actuator board is in state {self.status.state}"
        if self._too_slow:
            return False, "ACT_FREQ is slower than the board's silence limit ACT_SILENCE"
        return _READY

    def _sentence(self, fault: str) -> str:
        return REASONS[fault].format(theirs=self._protocol, ours=wire.PROTOCOL)

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Return what the operator should read, oldest first, and forget it."""
        texts, self._texts = self._texts, []
        return texts

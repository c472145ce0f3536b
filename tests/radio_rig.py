"""A station in front of the gateway, the air, and the whole simulated vessel: what an operator sees over the radio, in virtual time.

Vessel and gateway are served each hundredth of a second, as two programs of their own would be that wake when bytes come.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import config
from companion.io.links.link import Received
from companion.io.links.mem import pair
from companion.settings.schema import load
from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.wire.codec import decode
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.gateway import with_gateway
from sitl.radio import RadioConfig
from sitl.world.settings import SimSettings
from tests.anew import RebootingWorld
from tests.gateways import gateway_beside
from tests.qgc_buttons import ARM, ARM_S, GUIDED, HOLD, SET_MODE, Generation
from tests.qgc_client import QgcClient

MEMORY = ('sensors=[{url="mem:nmea"}]', "actuators.url=mem:ard", "endpoints=[]", "radio.url=mem:radio")
X, Y = 411_852_000, -87_060_000
LOITER = [
    (0, 16, 0.0, 0.0, 0.0, 0.0, X, Y, 0.0),
    (2, 178, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
    (3, 19, 600.0, 0.0, 20.0, 0.0, X, Y, 0.0),
]
PERIOD_US = 10_000
IN_PROGRESS = 5
EXCHANGE_S = 0.74
"""Order, answer and all between them, when nothing is lost."""
ACKNOWLEDGED_MODES = {15: Mode.GUIDED, 4: Mode.HOLD, 10: Mode.AUTO, 11: Mode.RTL}


class _World(RebootingWorld):
    def _serve_radio(self) -> None:
        """Both ends are served between two ticks by the rig."""


@dataclass
class Seen:
    """What a campaign counts."""

    arms: int = 0
    arm_popups: int = 0
    popups: list[str] = field(default_factory=list)
    shown_s: list[float] = field(default_factory=list)
    """From an accepted order's acknowledgement to the HEARTBEAT that shows it."""
    false: list[str] = field(default_factory=list)
    """Acknowledged or shown, and not so aboard."""
    differing: list[str] = field(default_factory=list)
    """Ends of a phase at which boat, gateway and station were not in one state."""
    sailing_s: list[float] = field(default_factory=list)


class Shown:
    """What the boat was, one after the other, and how far a station has seen it: what it is shown next may be late, and never older."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._history: list[object] = []
        self._seen = 0

    def is_now(self, what: object) -> None:
        """The boat is this."""
        if not self._history or self._history[-1] != what:
            self._history.append(what)

    def may_be(self, what: object) -> bool:
        """The station is shown this."""
        if what not in self._history[self._seen :]:
            return False
        self._seen = self._history.index(what, self._seen)
        return True


class RadioScreen:
    """One vessel, one gateway, one station."""

    def __init__(
        self,
        folder: Path,
        client: QgcClient | None = None,
        *,
        seed: int = 1,
        profile: str = "o-10",
        persona: str = "ardurover",
    ) -> None:
        settings = with_gateway(
            load(config.path("sim.toml"), [*MEMORY, f"radio.profile={profile}"], SimSettings), folder
        )
        self.client = client or QgcClient(generation=Generation.V4)
        self.sim = _World(settings, seed)
        near, self.link = pair("gcs")
        self.gateway_speaks_rover = persona == "ardurover"
        self.gateway = gateway_beside(self.sim, folder, near, seed=seed, persona=persona)
        self.link.poll(0)
        self.now_us = 0
        self.seen = Seen()
        self._ear = Deframer()
        self._modes, self._arming = Shown("mode"), Shown("armed")
        self._owed: list[tuple[int, Callable[[Any], bool], str]] = []
        self._pressed: list[int] = []
        """Modes that were sent and have no answer yet: an acknowledgement does not name its mode."""
        self._mouth = Deframer()

    @property
    def air(self) -> Any:
        return self.sim.surroundings.radio.air

    def lose(self, share: float, draws: str) -> None:
        """From now on the air loses so many packets, by draws of their own."""
        self.air.configure(RadioConfig(loss=share))
        self.air._rng = random.Random(draws)

    def turn(self) -> None:
        """A hundredth of a second."""
        self.now_us += PERIOD_US
        if self.now_us - self.sim.now_us >= self.sim.period_us:
            self.sim.step()
        else:
            was_busy = self.air.is_busy
            self.sim.surroundings.pump(self.now_us)
            if was_busy or self.air.is_busy:
                self.sim.loop_app.pump(self.now_us)
        if self.sim.snapshot is not None:
            self._modes.is_now(self.sim.snapshot.mode)
            self._arming.is_now(self.sim.snapshot.armed)
        self.gateway.tick(self.now_us)
        self.sim.surroundings.pump(self.now_us)
        for _ in range(40):
            if not self._talk():
                break

    def _talk(self) -> bool:
        heard = [event.data for event in self.link.poll(self.now_us) if isinstance(event, Received)]
        for data in heard:
            self._watch(data)
            self.client.receive(data, self.now_us)
        said = self.client.take(self.now_us)
        for message in map(decode, self._mouth.receive(said, self.now_us)):
            if message is not None and message.get_type() == "COMMAND_LONG" and message.command == SET_MODE:
                self._pressed.append(round(message.param2))
        if said:
            self.link.write(0, said)
        if heard or said:
            self.gateway.pump(self.now_us)
            # what it writes is on the serial line now, not at the next turn
            self.sim.surroundings.pump(self.now_us)
        return bool(heard or said)

    # ---- what is judged

    def _watch(self, data: bytes) -> None:
        """Every acceptance is owed a HEARTBEAT that shows it; every showing has to be true aboard."""
        for frame in self._ear.receive(data, self.now_us):
            message = decode(frame)
            kind = "" if message is None else message.get_type()
            if kind == "COMMAND_ACK" and message.result != IN_PROGRESS:
                mode = self._pressed.pop(0) if message.command == SET_MODE and self._pressed else None
                if message.result == 0:
                    self._accepted(message.command, mode)
            elif kind == "HEARTBEAT" and message.get_srcComponent() == 1:
                self._showing(message)
                for owed in [owed for owed in self._owed if owed[1](message)]:
                    self._owed.remove(owed)
                    self.seen.shown_s.append((self.now_us - owed[0]) * 1e-6)

    def _showing(self, beat: Any) -> None:
        """A late picture is none of an earlier time than the last one was."""
        mode = ACKNOWLEDGED_MODES.get(beat.custom_mode) if self.gateway_speaks_rover else None
        for shown, what in ((self._modes, mode), (self._arming, bool(beat.base_mode & 128))):
            if what is not None and not shown.may_be(what):
                self.seen.false.append(f"{self.now_us * 1e-6:.2f} back to {shown.name}={what}")

    def _accepted(self, command: int, mode: int | None) -> None:
        if command == ARM:
            wanted = self.client.wants_armed
            if self.armed != wanted:
                self.seen.false.append(f"{self.now_us * 1e-6:.2f} armed={wanted}")
            self._owe(self.client.armed == wanted, lambda beat: bool(beat.base_mode & 128) == wanted, "armed")
        elif mode is not None and mode == self.client.wants_mode:
            if self.sim.snapshot.mode is not ACKNOWLEDGED_MODES[mode]:
                self.seen.false.append(f"{self.now_us * 1e-6:.2f} mode={mode}")
            self._owe(self.client.mode == mode, lambda beat: beat.custom_mode == mode, f"mode {mode}")

    def _owe(self, is_shown: bool, shows: Callable[[Any], bool], what: str) -> None:
        """A HEARTBEAT has to show it, unless the last one did already: a state may come before the answer that was lost."""
        if is_shown:
            self.seen.shown_s.append(0.0)
        else:
            self._owed.append((self.now_us, shows, what))

    @property
    def armed(self) -> bool:
        return bool(self.sim.snapshot is not None and self.sim.snapshot.armed)

    def agree(self, what: str) -> None:
        """Boat, gateway and station are in one and the same state, or it is noted."""
        shown = self.gateway.twin.state
        boat = self.sim.snapshot
        same = shown is not None and (shown.mode, shown.armed) == (boat.mode, boat.armed)
        station = ACKNOWLEDGED_MODES.get(self.client.mode or 0)
        if not same or station is not boat.mode or self.client.armed != boat.armed:
            self.seen.differing.append(f"{what}: boat {boat.mode} {boat.armed}, station {station} {self.client.armed}")

    # ---- what an operator does

    def wait(self, seconds: float) -> None:
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.turn()

    def run(self, script: Any = None, limit_s: float = 120.0) -> Any:
        if script is not None:
            self.client.start(script)
        end_us = self.now_us + limit_s * 1e6
        while self.now_us < end_us:
            self.turn()
            if self.client.idle:
                return self.client.result
        raise AssertionError(f"no end: {self.client.report}")

    def until(self, holds: Callable[[], bool], limit_s: float) -> bool:
        end_us = self.now_us + limit_s * 1e6
        while self.now_us < end_us and not holds():
            self.turn()
        return holds()


def connected(
    folder: Path, generation: Generation = Generation.V4, *, seed: int = 1, client: QgcClient | None = None
) -> RadioScreen:
    """A station that has connected on a clean air and uploaded a loiter."""
    screen = RadioScreen(folder, client or QgcClient(generation=generation), seed=seed)
    screen.run()
    screen.wait(30.0)
    assert screen.run(screen.client.upload_plan(LOITER))
    return screen


def voyage(screen: RadioScreen, phase_s: float) -> None:
    """Start, hold, go on, go to, return, disarm: each until it is so, as an operator presses again what did not come."""
    client, seen = screen.client, screen.seen
    screen.wait(phase_s)
    began_us = screen.now_us
    for attempt in range(4):
        before = len(client.report.popups)
        seen.arms += not screen.armed
        screen.run(client.start_mission())
        seen.arm_popups += any("failed to arm" in text for text in client.report.popups[before:])
        if screen.until(lambda: client.mode == 10 and client.armed, 8.0):
            if attempt == 0:
                seen.sailing_s.append((screen.now_us - began_us) * 1e-6)
            break
    for script, mode in (
        (lambda: client.mode_menu(HOLD), HOLD),
        (client.continue_mission, 10),
        (lambda: client.go_to(X + 500, Y), 15),
        (client.return_home, 11),
    ):
        screen.wait(2.5)
        for _ in range(4):
            screen.run(script())
            if screen.until(lambda mode=mode: client.mode == mode, 8.0):
                break
    screen.wait(2.5)
    for _ in range(4):
        screen.run(client.disarm())
        if screen.until(lambda: not client.armed, 8.0):
            break
    screen.wait(12.0)
    screen.agree(f"{screen.now_us * 1e-6:.1f}")


def oracle_is_late(loss: float, draws: str) -> bool:
    """Whether an arming comes too late for who repeats back to back, each exchange of two packets, by the same draws."""
    draw = random.Random(draws)
    return not any(draw.random() >= loss and draw.random() >= loss for _ in range(int(ARM_S / EXCHANGE_S)))


def armings(screen: RadioScreen, phases: int, loss: float) -> tuple[int, int]:
    """Arm as the start slider does, on an air that begins to lose with the arming: how many end in a box, for us and for the oracle."""
    client, late, late_oracle = screen.client, 0, 0
    for phase in range(phases):
        screen.wait(2.5 + 4.9 * phase / phases)
        screen.run(client.validated_mode(GUIDED))
        screen.wait(0.2)
        screen.lose(loss, f"{loss}/{phase}")
        late += not screen.run(client.validated_arm())
        late_oracle += oracle_is_late(loss, f"{loss}/{phase}")
        screen.wait(6.0)
        screen.lose(0.0, "none")
        screen.wait(5.5)
        screen.agree(f"arming {phase}")
        for script in (client.disarm, lambda: client.mode_menu(HOLD)):
            screen.wait(2.5)
            screen.run(script())
        assert screen.until(lambda: not client.armed and client.mode == HOLD, 10.0)
    return late, late_oracle


def campaign(screen: RadioScreen, phases: int, loss: float, *, only: range | None = None) -> Seen:
    """Voyages at phases of the vessel's rhythm spread evenly, on an air that loses so much; ``only`` some of them."""
    before = len(screen.client.report.popups)
    for phase in only or range(phases):
        screen.lose(loss, f"{loss}/{phase}")
        voyage(screen, 4.9 * phase / phases)
    screen.seen.popups = screen.client.report.popups[before:]
    return screen.seen

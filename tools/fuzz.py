"""``make fuzz``: hostile frames against the whole simulated vessel, with the promises checked after every tick; then every other
decoder by itself (``tools.fuzzing.decoders``).

Promises: no exception in a tick; thrusters within -1...1, rudders within 1.6 rad, pulses within 1000...2000 us; no thrust
while disarmed; what the vessel sends is whole frames; memory grows by less than 5 MB. Frames that broke a promise are kept
in the corpus folder and played first by the next run. ``--frames`` counts frames; a million take a few minutes.
"""

from __future__ import annotations

import argparse
import gc
import hashlib
import logging
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import config
from companion.io.recording.log_archive import LogArchive
from companion.logs import Logs
from companion.settings import load
from mavlink_bridge.mavlink.endpoint import Endpoint
from mavlink_bridge.mavlink.wire.extensions import messages as all_messages
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.world import SimSettings, World
from tools.fuzzing.decoders import fuzz_decoders
from tools.fuzzing.frames import FrameMaker

CORPUS: Final = Path(__file__).resolve().parents[1] / "tests" / "data" / "fuzz"
FRAMES_A_TICK: Final = 60
"""Below the flood limit, so that all are read."""
LATCHED_TICKS: Final = 100
WARM_TICKS: Final = 500
"""After so many ticks of a vessel's life its memory is measured for the first time."""
IDLE_TICKS: Final = 2_000
"""A vessel that is not armed for so long has been talked out of it for good: a new one is more interesting."""
GROWTH_LIMIT_KB: Final = 5_000


@dataclass(slots=True)
class Outcome:
    """What a run found. ``growth_kb``: the most that memory grew within one vessel's life, after its warm-up."""

    frames: int = 0
    ticks: int = 0
    broken: list[str] = field(default_factory=list)
    growth_kb: int = 0
    seconds: float = 0.0
    sent_bytes: int = 0
    armed_ticks: int = 0

    @property
    def holds(self) -> bool:
        return not self.broken and self.growth_kb < GROWTH_LIMIT_KB


class Target:
    """A simulated vessel with its ground links in memory."""

    def __init__(self, seed: int) -> None:
        self.world = World(load(config.path("sim.toml"), [], SimSettings), seed=seed)
        names = [settings.name for settings in self.world.settings.endpoints]
        self.links = [self.world.ground(name) for name in names]
        self._deframers = [Deframer() for _ in names]
        self._give_logs()
        self.sent_bytes = 0
        for _ in range(2):
            for link in self.links:
                link.poll(0)
            self.world.step()

    def _give_logs(self) -> None:
        """Something to list, download and erase."""
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name)
        for name in ("earlier", "now"):
            (folder / name).mkdir()
            (folder / name / "mavlink.tlog").write_bytes(bytes(50_000))
            (folder / name / "run.json").write_text('{"vessel_id": "fuzzed"}')
        app = self.world.app
        app.facade.logs = Logs(LogArchive(folder, folder / "now"), app.vehicle.controls.voice.say)

    def endpoint(self) -> Endpoint:
        """One of the vessel's endpoints, for its list of accepted messages."""
        for ground in self.world.app.grounds:
            for talk in ground.conversations.values():
                if isinstance(talk, Endpoint):
                    return talk
        raise RuntimeError("no endpoint is open")

    def accepted(self) -> list[str]:
        """Names of the messages that an endpoint acts upon."""
        return sorted(all_messages[number].msgname for number in self.endpoint().handled)

    def tick(self, frames: list[tuple[int, bytes]]) -> str:
        """Feed frames to links, run a tick; return the broken promise, or an empty string."""
        for number, raw in frames:
            self.links[number].write(0, raw)
        app = self.world.app
        app.stop_wanted = app.shutdown_wanted = False
        try:
            snapshot = self.world.tick()
        except Exception as error:  # the point of the exercise
            return f"exception {error!r}"
        if snapshot is None:
            return "a tick failed"
        return self._broken() or self._read_answers()

    def _broken(self) -> str:
        snapshot = self.world.snapshot
        assert snapshot is not None
        output = snapshot.output
        if not (abs(output.thruster_port) <= 1.0 and abs(output.thruster_starboard) <= 1.0):
            return f"thrust out of range: {output}"
        if not (abs(output.rudder_port_rad) <= 1.6 and abs(output.rudder_starboard_rad) <= 1.6):
            return f"rudder out of range: {output}"
        if not snapshot.armed and (output.thruster_port or output.thruster_starboard):
            return f"thrust while disarmed: {output}"
        pulses = snapshot.commanded_us or ()
        if not all(1000 <= pulse <= 2000 for pulse in pulses):
            return f"pulse out of range: {pulses}"
        return ""

    def _read_answers(self) -> str:
        for link, deframer in zip(self.links, self._deframers, strict=True):
            for event in link.poll(self.world.now_us):
                data = getattr(event, "data", b"")
                self.sent_bytes += len(data)
                deframer.receive(data, self.world.now_us)
            if deframer.counters.skipped_bytes:
                return f"the vessel sent {deframer.counters.skipped_bytes} bytes that are no frame"
        return ""


def memory_kb() -> int:
    """Resident memory of this process, once what is garbage has been let go."""
    gc.collect()
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1])
    return 0


def fuzz(frames: int, seed: int, corpus: Path = CORPUS, *, keep: bool = True, progress: bool = False) -> Outcome:
    """Run; equal arguments do the same. Frames that break something are written to ``corpus`` when ``keep``."""
    target = Target(seed)
    outcome = Outcome()
    for kept in sorted(corpus.glob("*.bin")):
        outcome.broken += [f"{kept.name}: {what}" for what in [_replay(target, kept.read_bytes())] if what]
    params = [entry.param.name for entry in target.world.app.facade.params.entries]
    maker = FrameMaker(seed, target.accepted(), params)
    base_kb = latched = idle = lived = 0
    started = time.monotonic()
    while outcome.frames < frames and len(outcome.broken) < 10:
        batch = [(maker.rng.randrange(len(target.links)), maker.next()) for _ in range(FRAMES_A_TICK)]
        what = target.tick(batch)
        outcome.frames += len(batch)
        outcome.ticks += 1
        snapshot = target.world.snapshot
        outcome.armed_ticks += bool(snapshot and snapshot.armed)
        latched = latched + 1 if snapshot and snapshot.terminated else 0
        idle = 0 if snapshot and snapshot.armed else idle + 1
        if what:
            outcome.broken.append(what)
            if keep:
                _keep(corpus, batch)
        if what or latched > LATCHED_TICKS or idle > IDLE_TICKS:
            # a terminated vessel stays so until restart, and would answer nothing interesting any more
            outcome.growth_kb = max(outcome.growth_kb, memory_kb() - base_kb) if base_kb else outcome.growth_kb
            outcome.sent_bytes += target.sent_bytes
            target, latched, idle, base_kb, lived = Target(seed + outcome.ticks), 0, 0, 0, 0
        maker.may_terminate = outcome.frames > 0.95 * frames
        lived += 1
        if lived == WARM_TICKS:
            base_kb = memory_kb()
        if progress and outcome.ticks % 1000 == 0:
            print(
                f"\r{outcome.frames} frames, {outcome.frames / (time.monotonic() - started):.0f}/s", end="", flush=True
            )
    if base_kb:
        outcome.growth_kb = max(outcome.growth_kb, memory_kb() - base_kb)
    outcome.seconds = time.monotonic() - started
    outcome.sent_bytes += target.sent_bytes
    return outcome


def _replay(target: Target, data: bytes) -> str:
    """Play a kept batch: each frame with its link number and length in front."""
    batch, at = [], 0
    while at + 3 <= len(data):
        length = int.from_bytes(data[at + 1 : at + 3], "little")
        batch.append((data[at] % len(target.links), data[at + 3 : at + 3 + length]))
        at += 3 + length
    return target.tick(batch)


def _keep(corpus: Path, batch: list[tuple[int, bytes]]) -> None:
    corpus.mkdir(parents=True, exist_ok=True)
    data = b"".join(bytes((number,)) + len(raw).to_bytes(2, "little") + raw for number, raw in batch)
    (corpus / f"{hashlib.sha256(data).hexdigest()[:16]}.bin").write_bytes(data)


def main(arguments: list[str] | None = None) -> int:
    """Command line. Exit status 1 when a promise is broken."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--corpus", type=Path, default=CORPUS)
    options = parser.parse_args(arguments)
    logging.disable(logging.CRITICAL)
    outcome = fuzz(options.frames, options.seed, options.corpus, progress=True)
    rounds = options.frames // 50
    outcome.broken += fuzz_decoders(rounds, options.seed)
    print(
        f"\n{outcome.frames} frames in {outcome.ticks} ticks ({outcome.armed_ticks} armed), {outcome.seconds:.0f} s, "
        f"{outcome.sent_bytes} bytes answered, memory +{outcome.growth_kb} kB; {rounds} inputs for each other decoder"
    )
    for what in outcome.broken:
        print("BROKEN:", what)
    return 0 if outcome.holds else 1


if __name__ == "__main__":
    sys.exit(main())

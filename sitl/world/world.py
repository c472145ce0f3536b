"""The simulated world with a real vessel's process inside, in lock-step: the public Python API of the simulator.

    world = World(load(None, model=SimSettings), seed=7)
    while world.now_us < 60_000_000:
        truth = world.step()

``World`` runs the very ``App`` that sails the boat; only clock and links differ. Without ``run_dir`` nothing is written.
By default every link is a pair in memory, so equal seeds give equal bytes; ``real_links`` opens the configured ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from companion.build import build_app, in_run_dir
from companion.facade import identity_of
from companion.io.keeping import AnyStore, MemoryStore
from companion.io.keeping.mark import WorldKind
from companion.io.links import Link, open_link
from companion.io.links.mem import MemLink
from companion.io.log_file import LogFile
from companion.io.loop import LoopApp
from companion.io.recording import Recorder, Recording
from companion.io.recording.recorder import SHARES
from companion.io.recording.truth import TRUTH_COLUMNS, truth_row
from companion.settings import load_vessel
from companion.worlds import digest_of, simulated_content
from mavlink_bridge.language.messages import Mode, Severity
from mavlink_bridge.language.snapshot import Snapshot

from ..plant import Truth
from ..plant.truth import SIM_UTC_START_US
from .metrics import Metrics
from .plant import Board
from .settings import SimSettings
from .surroundings import Surroundings

_RADIO_STEP_US = 10_000
_MOST_MISSED = 2
_FORGOTTEN_US = 1_000_000
_FLUSH_US = 1_000_000
"""How often ``truth.csv`` is written: a run that is killed loses at most the last second."""
_DEG = 180.0 / math.pi


class World:
    """Water, hull, sensors, board, radio and the vessel's process."""

    def __init__(
        self,
        settings: SimSettings,
        seed: int = 0,
        *,
        run_dir: Path | None = None,
        real_links: bool = False,
        store: AnyStore | None = None,
        board: Board | None = None,
        about: dict[str, Any] | None = None,
    ) -> None:
        self.settings = in_run_dir(settings, run_dir) if run_dir is not None else settings
        self.now_us = 0
        self.snapshot: Snapshot | None = None
        self._ground: dict[str, MemLink] = {}
        self._unused: list[MemLink] = []
        self._shore_listens = True
        """False: the shore modem is in memory, and nobody has asked for it."""
        self._mem: dict[str, MemLink] = {}
        self._vessel_ends: dict[str, MemLink] = {}
        self._ahead_us: int | None = None
        """How far the pacing clock is ahead of simulated time when nothing is missed."""
        hull = load_vessel(settings.world.vessel or settings.vessel)
        self.surroundings = Surroundings(
            self.settings,
            hull,
            seed,
            shore_url=f"pty:{run_dir}/lora" if real_links and run_dir else "mem:shore",
            make_link=open_link if real_links else self._far_end,
            board=board,
        )
        self._recording: Recording | None = None
        self._truth_file: LogFile | None = None
        self._mode: Mode | None = None
        self._mode_text = b""
        """The mode of the newest row, as the row shows it."""
        store = store or MemoryStore(simulated_content(seed))
        whose = {"world_kind": WorldKind.SIMULATED.value, "vessel_id": store.snapshot().vessel}
        if run_dir is not None and settings.record.enabled:
            self._record(run_dir, whose | (about or {}))
        self.app = build_app(
            self.settings,
            make_link=open_link if real_links else self._near_end,
            store=store,
            recording=self._recording,
            identity=identity_of(self.settings, chance=f"{seed}/{digest_of(store.snapshot())}"),
            about=about,
            board_seen=True,
        )
        self.loop_app: LoopApp = self.app if self._recording is None else self._recording.app(self.app)
        self.period_us = self.app.period_us
        self.metrics = Metrics(self.surroundings.plant.frame)
        self._keel_m = hull.keel_depth_m

    # ---- lock-step ----------------------------------------------------------------------------------------------

    def step(self) -> Truth:
        """Advance by one tick and return the truth after it."""
        self.tick()
        return self.surroundings.truth

    def run(self, duration_s: float) -> Truth:
        """Advance by a duration."""
        end_us = self.now_us + round(duration_s * 1e6)
        while self.now_us < end_us:
            self.step()
        return self.surroundings.truth

    def ground(self, name: str) -> MemLink:
        """Return the ground station's end of an endpoint's link in memory ('shore': the shore modem's serial port).

        Until it is asked for, what arrives there is thrown away. Raises KeyError for a name that no endpoint has.
        """
        end = self._ground[name]
        if end in self._unused:
            self._unused.remove(end)
            self._shore_listens = self._shore_listens or name == "shore"
        return end

    def vessel_end(self, name: str) -> MemLink:
        """Return the vessel's own end of a link in memory, to pull its cable. Raises KeyError for a name that no link has."""
        return self._vessel_ends[name]

    # ---- what companion.io.loop drives --------------------------------------------------------------------------

    @property
    def links(self) -> Sequence[Link]:
        return (*self.app.links, *self.surroundings.links)

    @property
    def stop_wanted(self) -> bool:
        """A ground station has asked for a reboot or shutdown."""
        return self.app.stop_wanted

    def tick(self, now_us: int = 0, *, late_s: float = 0.0, load: float = 0.0) -> object:
        """Move the world on by one period, then run the vessel's tick; on a busy machine up to three, so that the clock is not lost.

        Simulated time counts ticks and nothing else: where it cannot keep up it falls behind the clock instead of jumping, so
        that a slow laptop is not taken for a slow boat. ``now_us``: the clock that paces it, 0 in lock-step.
        """
        done = self._tick()
        if now_us:
            for _ in range(self._missed(now_us)):
                before, done = done, self._tick()
                if isinstance(before, Snapshot) and isinstance(done, Snapshot) and before.texts:
                    done = replace(done, texts=before.texts + done.texts)  # who watches sees the last tick only
        return done

    def _missed(self, now_us: int) -> int:
        """How many ticks to make up for; what is more than a second behind is forgotten."""
        behind_us = now_us - self.now_us - self._ahead_us if self._ahead_us is not None else _FORGOTTEN_US
        if behind_us < self.period_us:
            return 0
        if behind_us >= _FORGOTTEN_US:
            self._ahead_us = now_us - self.now_us
            return 0
        return min(behind_us // self.period_us, _MOST_MISSED)

    def _tick(self) -> object:
        if self._shore_listens:
            self._serve_radio()
        self.now_us = now_us = self.now_us + self.period_us
        truth = self.surroundings.step(now_us)
        snapshot = self.loop_app.tick(now_us)
        self.surroundings.carry_commands()
        for end in self._unused:
            end.discard(now_us)
        if isinstance(snapshot, Snapshot):
            self.snapshot = snapshot
            self.metrics.add(truth, snapshot, self.app.vehicle.parts.mission.plan)
            self._write_truth(truth, snapshot)
        return snapshot

    def tell(self, severity: Severity, text: str) -> None:
        """A text for the operator that came from beside the world, recorded like all that comes in."""
        (self.app.controls.voice.say if self._recording is None else self._recording.recorder.tell)(severity, text)

    def pump(self, now_us: int) -> None:
        """Serve links between ticks, at the time of the last one."""
        self.surroundings.pump(self.now_us)
        self.loop_app.pump(self.now_us)

    def shutdown(self, now_us: int) -> None:
        """Neutral to the board, files closed."""
        self.loop_app.shutdown(self.now_us)
        self.surroundings.step(self.now_us + self.period_us)
        self.surroundings.close()
        if self._truth_file is not None:
            self._truth_file.close(self.now_us)

    def not_recorded(self) -> str:
        """What of the run is not on the disk though it should be, and why; "" when all of it is. Asked after ``shutdown``."""
        missing = "" if self._recording is None else self._recording.recorder.missing()
        if not missing and self._truth_file is not None and self._truth_file.dropped:
            missing = self._truth_file.first.name
        return missing

    # ---- inside -------------------------------------------------------------------------------------------------

    def _serve_radio(self) -> None:
        """While the radio has bytes under way, they come and go between two ticks as well, as they do on the boat.

        Nobody at the shore modem in memory: nothing can come back, and the ticks alone will do.
        """
        was_busy = True
        for at_us in range(self.now_us + _RADIO_STEP_US, self.now_us + self.period_us, _RADIO_STEP_US):
            is_busy = self.surroundings.radio.is_busy
            if not is_busy and not was_busy:
                return
            was_busy = is_busy
            self.surroundings.pump(at_us)
            self.loop_app.pump(at_us)

    def _record(self, run_dir: Path, about: dict[str, Any]) -> None:
        limits = self.settings.record
        recorder = Recorder(run_dir, max_mb=limits.max_mb, free_floor_mb=limits.free_floor_mb, about=about)
        self._recording = Recording(recorder, lambda: SIM_UTC_START_US + self.now_us)
        self._truth_file = LogFile(
            run_dir / "truth.csv",
            None,
            lambda text: None,
            header=TRUTH_COLUMNS.encode() + b"\n",
            max_bytes=(limits.max_mb << 20) // SHARES,
        )

    def _far_end(self, name: str, url: str) -> Link:
        """The world's end of a memory link."""
        if url == "mem:shore":
            near, far = _pair("shore", datagrams=False)
            self._offer("shore", far)
            self._shore_listens = False
            return near
        near, far = _pair(name.removeprefix("world-"), datagrams=False)
        self._mem[near.name] = near
        return far

    def _near_end(self, name: str, url: str, **options: object) -> Link:
        """The vessel's end of a memory link."""
        near = self._mem.pop(name, None)
        if near is None:
            near, far = _pair(name, datagrams=url.startswith("udp"))
            self._offer(name, far)
        self._vessel_ends[name] = near
        return near

    def _offer(self, name: str, end: MemLink) -> None:
        self._ground[name] = end
        self._unused.append(end)

    def _write_truth(self, truth: Truth, snapshot: Snapshot) -> None:
        file = self._truth_file
        if file is None:
            return
        if snapshot.mode is not self._mode:
            self._mode, self._mode_text = snapshot.mode, snapshot.mode.value.encode()
        hull = self.surroundings.plant.vessel
        port, starboard = hull.revs
        port_rad, starboard_rad = hull.rudder_rad
        depth = math.nan if truth.depth_m is None else truth.depth_m
        file.add(
            truth_row(
                (
                    truth.t_us * 1e-6,
                    truth.lat_rad * _DEG,
                    truth.lon_rad * _DEG,
                    truth.north_m,
                    truth.east_m,
                    truth.psi_rad * _DEG % 360.0,
                    truth.u_mps,
                    truth.v_mps,
                    truth.r_radps * _DEG,
                    math.hypot(truth.vn_mps, truth.ve_mps),
                    port,
                    starboard,
                    port_rad * _DEG,
                    starboard_rad * _DEG,
                    depth,
                    depth - self._keel_m,
                    self._mode_text,
                    snapshot.armed,
                    snapshot.progress.seq,
                )
            )
        )
        if truth.t_us % _FLUSH_US < self.period_us:
            file.flush(truth.t_us)


def _pair(name: str, *, datagrams: bool) -> tuple[MemLink, MemLink]:
    near, far = MemLink(name, datagrams=datagrams), MemLink(f"{name}-far", datagrams=datagrams)
    near.connect(far)
    return near, far

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
from pathlib import Path
from typing import Any

from companion.build import build_app, in_run_dir
from companion.io.link import Link
from companion.io.link_mem import MemLink
from companion.io.links import open_link
from companion.io.log_file import LogFile
from companion.io.loop import LoopApp
from companion.io.recorder import Recorder
from companion.io.recording import Recording
from companion.io.store import AnyStore
from companion.io.truth import TRUTH_COLUMNS, Truth as Row, truth_row
from companion.settings import load_vessel
from mavlink_bridge.snapshot import Snapshot

from .metrics import Metrics
from .plant import Board
from .settings import SimSettings
from .surroundings import Surroundings
from .truth import Truth, utc_us

_RADIO_STEP_US = 10_000
_MOST_MISSED = 2
_FORGOTTEN_US = 1_000_000


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
        if run_dir is not None and settings.record.enabled:
            self._record(run_dir, about or {})
        self.app = build_app(
            self.settings,
            make_link=open_link if real_links else self._near_end,
            store=store,
            recording=self._recording,
            reproducible=True,
            about=about,
        )
        self.loop_app: LoopApp = self.app if self._recording is None else self._recording.app(self.app)
        self.metrics = Metrics(self.surroundings.plant.frame)
        self._keel_m = hull.keel_depth_m

    # ---- lock-step ----------------------------------------------------------------------------------------------

    @property
    def period_us(self) -> int:
        return self.app.period_us

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
        for _ in range(self._missed(now_us) if now_us else 0):
            done = self._tick()
        return done

    def _missed(self, now_us: int) -> int:
        """How many ticks to make up for; what is more than a second behind is forgotten."""
        behind_us = now_us - self.now_us - self._ahead_us if self._ahead_us is not None else _FORGOTTEN_US
        if behind_us >= _FORGOTTEN_US:
            self._ahead_us = now_us - self.now_us
            return 0
        return min(max(behind_us, 0) // self.period_us, _MOST_MISSED)

    def _tick(self) -> object:
        self._serve_radio()
        self.now_us += self.period_us
        truth = self.surroundings.step(self.now_us)
        snapshot = self.loop_app.tick(self.now_us)
        self.surroundings.carry_commands()
        for end in self._unused:
            end.discard(self.now_us)
        if isinstance(snapshot, Snapshot):
            self.snapshot = snapshot
            self.metrics.add(truth, snapshot, self.app.vehicle.mission.plan)
            self._write_truth(truth, snapshot)
        return snapshot

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

    # ---- inside -------------------------------------------------------------------------------------------------

    def _serve_radio(self) -> None:
        """While the radio has bytes under way, they come and go between two ticks as well, as they do on the boat.

        Nobody at the shore modem in memory: nothing can come back, and the ticks alone will do.
        """
        if self._ground.get("shore") in self._unused:
            return
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
        self._recording = Recording(recorder, lambda: utc_us(self.now_us))
        self._truth_file = LogFile(
            run_dir / "truth.csv",
            None,
            lambda text: None,
            header=TRUTH_COLUMNS.encode() + b"\n",
            max_bytes=limits.max_mb << 20,
        )

    def _far_end(self, name: str, url: str) -> Link:
        """The world's end of a memory link."""
        if url == "mem:shore":
            near, far = _pair("shore", datagrams=False)
            self._offer("shore", far)
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
        if self._truth_file is None:
            return
        hull = self.surroundings.plant.vessel
        depth = math.nan if truth.depth_m is None else truth.depth_m
        self._truth_file.add(
            truth_row(
                Row(
                    truth.t_us * 1e-6,
                    math.degrees(truth.lat_rad),
                    math.degrees(truth.lon_rad),
                    truth.north_m,
                    truth.east_m,
                    math.degrees(truth.psi_rad) % 360.0,
                    truth.u_mps,
                    truth.v_mps,
                    math.degrees(truth.r_radps),
                    math.hypot(truth.vn_mps, truth.ve_mps),
                    hull.revs[0],
                    hull.revs[1],
                    math.degrees(hull.rudder_rad[0]),
                    math.degrees(hull.rudder_rad[1]),
                    depth,
                    depth - self._keel_m,
                    snapshot.mode.value,
                    int(snapshot.armed),
                    snapshot.progress.seq,
                )
            )
        )
        if truth.t_us % 1_000_000 < self.period_us:
            self._truth_file.flush(truth.t_us)


def _pair(name: str, *, datagrams: bool) -> tuple[MemLink, MemLink]:
    near, far = MemLink(name, datagrams=datagrams), MemLink(f"{name}-far", datagrams=datagrams)
    near.connect(far)
    return near, far

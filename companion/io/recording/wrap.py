"""Puts a recorder around an app from outside: its links, its store, its calls. The app cannot tell.

    recording = Recording(recorder, clock.utc_us)
    link = recording.link(open_link("gcs", "udp://..."), mavlink=True)      one for each link, in the order of reading
    store = recording.store(Store(path))
    recording.start({"settings": ...})                                      then build the app from these
    loop.run(recording.app(app), clock, stop)

A replay builds the same app from the same settings with ``ReplayLinks`` and ``ReplayStore`` instead.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.requests import RequestBody
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.stations import Station
from mavlink_bridge.language.witness import Witness

from ..keeping import AnyStore
from ..keeping.content import to_json
from ..links import Link
from ..loop import LoopApp, Waited
from . import request_json
from .frame_log import FrameClock, FrameLog
from .input_recorder import RecordingLink, RecordingStore, RecordingWitness
from .inputs import StepKind
from .log_archive import AnyArchive, RecordingArchive
from .recorder import Recorder

_UNITS: Final = ((86_400.0, "days"), (3_600.0, "h"), (60.0, "min"), (1.0, "s"))
"""In which a person thinks of a clock that was wrong: the largest of which there are two."""


class Recording:
    """Everything recorded of one app. Wrap first, ``start`` once, then run the app through ``app``."""

    def __init__(self, recorder: Recorder, utc_us: Callable[[], int | None]) -> None:
        self.recorder = recorder
        self._utc_us = utc_us
        self._links: list[RecordingLink] = []
        self._store: AnyStore | None = None
        self._taps = 0
        self._submitted: list[str] = []
        self._inputs = recorder.inputs
        self._clock = FrameClock()
        self.tick: Callable[[Snapshot], None] = recorder.tick
        """The app's recorder: keep one tick."""

    def link(self, link: Link, *, mavlink: bool = False, keep: bool | None = None) -> Link:
        """Wrap a link. ``mavlink``: its frames go into the telemetry log, else what is written is kept with the inputs."""
        frames = None
        if mavlink:
            frames = FrameLog(self._taps, link.datagrams, self.recorder.frames, self._clock)
            self._taps += 1
        wrapped = RecordingLink(link, self._inputs, len(self._links), not mavlink if keep is None else keep, frames)
        self._links.append(wrapped)
        return wrapped

    def store(self, store: AnyStore) -> AnyStore:
        """Wrap the store."""
        self._store = store
        return RecordingStore(store, self._inputs)

    def witness(self) -> Witness:
        """What keys are used through."""
        return RecordingWitness(self._inputs)

    def archive(self, archive: AnyArchive) -> AnyArchive:
        """Wrap the archive of logs."""
        return RecordingArchive(archive, lambda fetched: self._inputs.fetched(*fetched))

    def start(self, meta: Mapping[str, Any]) -> None:
        """Write the recording's header; call when all links and the store are wrapped."""
        links = [{"name": link.name, "datagrams": link.datagrams, "keep": link.keep} for link in self._links]
        warnings = list(self._store.warnings) if self._store else []
        content = to_json(self._store.snapshot()) if self._store else {}
        header = json.dumps({**meta, "links": links, "store_warnings": warnings}, default=str)
        self._inputs.start(without_place(json.loads(header), self.recorder.run_dir), content)

    def begin(self, kind: StepKind, now_us: int, *, load: float = 0.0, late_s: float = 0.0) -> None:
        """Open a step; ``app`` does this by itself."""
        utc_us, was_ahead = self._utc_us(), self._clock.ahead_us
        self._clock.move(utc_us, now_us)
        if self._clock.ahead_us and not was_ahead:
            self._tell_set_back(self._clock.ahead_us * 1e-6)
        self._inputs.begin(kind, now_us, utc_us=utc_us, load=load, late_s=late_s)
        if self._submitted:
            for text in self._submitted:
                self._inputs.submitted(text)
            self._submitted.clear()

    def _tell_set_back(self, by_s: float) -> None:
        unit_s, unit = next((found for found in _UNITS if by_s >= 2.0 * found[0]), _UNITS[-1])
        told = f"clock set back by {by_s / unit_s:.0f} {unit}: times in mavlink.tlog run on ahead of it in this run"
        self.recorder.tell(Severity.WARNING, f"Recorder: {told}")

    def submitted(self, body: RequestBody, station: Station | None = None) -> None:
        """Note a request that did not come over a link; it belongs to the next step."""
        self._submitted.append(request_json.dumps(body, station))

    def order(self, t_us: int, fields: dict[str, Any]) -> None:
        """Keep who ordered what."""
        self.recorder.event(t_us, "order", **fields)

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """The recorder's texts; they reach the operator, so they are input."""
        if not self.recorder.texts:
            return []
        texts = self.recorder.drain_texts()
        for severity, text in texts:
            self._inputs.told(int(severity), text)
        return texts

    def app(self, app: LoopApp) -> RecordedApp:
        """Wrap the app. One that takes requests without a link has an ``on_submit`` to tell of them."""
        if hasattr(app, "on_submit"):
            app.on_submit = self.submitted
        return RecordedApp(app, self)

    def close(self, now_us: int, **result: Any) -> None:
        """Finish the last step and close the run's files."""
        self._inputs.finish()
        self.recorder.close(now_us, **result)


def without_place(data: Any, run_dir: Path) -> Any:
    """``data`` with RUN_DIR for the run's directory: where a run was recorded is no part of it, equal runs are equal.

    Only a path that begins with the directory is meant: its name may be part of any other word.
    """
    given = str(run_dir)
    names = [rf"(?<![\w./-]){re.escape(given)}(?=/)"]
    if given != ".":  # the directory one works in holds other things too, a map or a key
        names.append(rf"(?:(?<=://)|(?<![\w./-])){re.escape(str(run_dir.absolute()))}(?![\w.-])")
    place = re.compile("|".join(names))

    def walk(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: walk(each) for key, each in value.items()}
        if isinstance(value, list):
            return [walk(each) for each in value]
        return place.sub("RUN_DIR", value) if isinstance(value, str) else value

    return walk(data)


class RecordedApp:
    """An app whose every call is a recorded step."""

    def __init__(self, app: LoopApp, recording: Recording) -> None:
        self._app = app
        self._recording = recording

    @property
    def links(self) -> Sequence[Waited]:
        return self._app.links

    @property
    def actuator_fresh(self) -> bool:
        return bool(getattr(self._app, "actuator_fresh", True))

    @property
    def sensed_us(self) -> int | None:
        return getattr(self._app, "sensed_us", None)

    @property
    def stop_wanted(self) -> bool:
        return bool(getattr(self._app, "stop_wanted", False))

    def pump(self, now_us: int) -> None:
        self._recording.begin("pump", now_us)
        self._app.pump(now_us)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        self._recording.begin("tick", now_us, load=load, late_s=late_s)
        return self._app.tick(now_us, late_s=late_s, load=load)

    def shutdown(self, now_us: int) -> None:
        self._recording.begin("stop", now_us)
        self._app.shutdown(now_us)
        self._recording.close(now_us)

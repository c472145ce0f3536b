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
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from companion.io import request_json
from companion.io.clock import EARLIEST_UTC_US
from companion.io.input_recorder import RecordingLink, RecordingStore
from companion.io.inputs import StepKind
from companion.io.link import Closed, Link, LinkEvent, Received
from companion.io.log_archive import AnyArchive, RecordingArchive
from companion.io.loop import LoopApp
from companion.io.recorder import Recorder
from companion.io.store import AnyStore
from companion.io.store_content import to_json
from mavlink_bridge.framing import Deframer
from mavlink_bridge.imc import Severity
from mavlink_bridge.requests import RequestBody
from mavlink_bridge.snapshot import Snapshot

_LOG_DATA: Final = b"\x78\x00\x00"
"""Message id of LOG_DATA: what is downloaded is a log already, and would push this run's own out."""


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
        self.stamp_us = EARLIEST_UTC_US
        """UTC of this step, for the telemetry log; counted from an arbitrary day while UTC is unknown."""

    def link(self, link: Link, *, mavlink: bool = False, keep: bool | None = None) -> Link:
        """Wrap a link. ``mavlink``: its frames go into the telemetry log, else what is written is kept with the inputs."""
        wrapped = RecordingLink(link, self._inputs, len(self._links), not mavlink if keep is None else keep)
        self._links.append(wrapped)
        if not mavlink:
            return wrapped
        self._taps += 1
        return TlogLink(wrapped, self, self._taps - 1)

    def store(self, store: AnyStore) -> AnyStore:
        """Wrap the store."""
        self._store = store
        return RecordingStore(store, self._inputs)

    def archive(self, archive: AnyArchive) -> AnyArchive:
        """Wrap the archive of logs."""
        return RecordingArchive(archive, lambda fetched: self._inputs.fetched(*fetched))

    def start(self, meta: Mapping[str, Any]) -> None:
        """Write the recording's header; call when all links and the store are wrapped."""
        links = [{"name": link.name, "datagrams": link.datagrams, "keep": link.keep} for link in self._links]
        warnings = list(self._store.warnings) if self._store else []
        content = to_json(self._store.snapshot()) if self._store else {}
        header = json.dumps({**meta, "links": links, "store_warnings": warnings}, default=str)
        # Where the run was recorded is no part of it: equal runs make equal recordings.
        header = header.replace(json.dumps(str(self.recorder.run_dir))[1:-1], "RUN_DIR")
        self._inputs.start(json.loads(header), content)

    def begin(self, kind: StepKind, now_us: int, *, load: float = 0.0, late_s: float = 0.0) -> None:
        """Open a step; ``app`` does this by itself."""
        utc_us = self._utc_us()
        self.stamp_us = EARLIEST_UTC_US + now_us if utc_us is None else utc_us
        self._inputs.begin(kind, now_us, utc_us=utc_us, load=load, late_s=late_s)
        for text in self._submitted:
            self._inputs.submitted(text)
        self._submitted.clear()

    def submitted(self, body: RequestBody) -> None:
        """Note a request that did not come over a link; it belongs to the next step."""
        self._submitted.append(request_json.dumps(body))

    def tick(self, snapshot: Snapshot) -> None:
        """The app's recorder: keep one tick."""
        self.recorder.tick(snapshot)

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """The recorder's texts; they reach the operator, so they are input."""
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


class RecordedApp:
    """An app whose every call is a recorded step."""

    def __init__(self, app: LoopApp, recording: Recording) -> None:
        self._app = app
        self._recording = recording

    @property
    def links(self) -> Sequence[Link]:
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


class TlogLink:
    """A link whose MAVLink frames, both directions, go into the telemetry log under its number."""

    def __init__(self, link: Link, recording: Recording, number: int) -> None:
        self._link = link
        self._recording = recording
        self._number = number
        self._deframers: dict[int, Deframer] = {}
        self.name = link.name
        self.datagrams = link.datagrams

    def poll(self, now_us: int) -> list[LinkEvent]:
        events = self._link.poll(now_us)
        for event in events:
            if isinstance(event, Received):
                deframer = self._deframers.get(event.channel)
                if deframer is None:
                    deframer = self._deframers[event.channel] = Deframer(datagrams=self.datagrams)
                for frame in deframer.receive(event.data, now_us):
                    self._keep(frame.raw)
            elif isinstance(event, Closed):
                self._deframers.pop(event.channel, None)
        return events

    def write(self, channel: int, data: bytes) -> int:
        accepted = self._link.write(channel, data)
        if accepted:
            keep, stamp_us = self._recording.recorder.frame, self._recording.stamp_us
            for raw in split_frames(data):
                if raw[7:10] != _LOG_DATA:
                    keep(self._number, stamp_us, raw)
        return accepted

    def _keep(self, raw: bytes) -> None:
        self._recording.recorder.frame(self._number, self._recording.stamp_us, raw)

    def filenos(self) -> list[int]:
        return self._link.filenos()

    def describe(self) -> str:
        return self._link.describe()

    def close(self) -> None:
        self._link.close()


def split_frames(data: bytes) -> list[bytes]:
    """Cut our own output, which holds whole MAVLink frames, into frames; a rest that is none is left out."""
    frames = []
    at = 0
    while at + 8 <= len(data) and data[at] in (0xFD, 0xFE):
        extra = 8 if data[at] == 0xFE else 25 if data[at + 2] & 1 else 12
        length = data[at + 1] + extra
        if at + length > len(data):
            break
        frames.append(data[at : at + length])
        at += length
    return frames

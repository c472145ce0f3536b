"""Runs a recording again through a freshly built app and compares what comes out, step by step.

The app gets the recorded settings, hull and identity, links that say again what they said, and a store that finishes
each change when it did. Compared are every write (length and checksum, or the bytes themselves on the actuators' line)
and every row of control.csv, field by field.
"""

from __future__ import annotations

import copy
import io
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ValidationError

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.mavlink.persona import Identity

from ..app import App, AppFaultError
from ..build import build_app
from ..core.hull import VesselConfig
from ..facade import made_by
from ..io.interpreter import compile_early
from ..io.links import Link
from ..io.recording import InputReader, InputsError, digests, request_json
from ..io.recording.frame_log import FrameClock
from ..io.recording.input_replay import Difference, ReplayLinks, ReplayStore, ReplayWitness
from ..io.recording.inputs import InputStep
from ..io.recording.log_archive import Fetched, ReplayArchive
from ..io.recording.recorder import control_row
from ..settings import ConfigError, Settings, explain, load_vessel
from ..settings.moved import carry_over
from ..settings.schema import override
from .frames import SentFrames, tell
from .rows import COLUMNS, control_rows, fields_of, nearly

MAX_DIFFERENCES: Final = 200
WORDED_DIFFERENCES: Final = 20
_SIMULATOR_S: Final = "world"
"""What a simulator's settings have beside the vessel's."""


class ReplayError(Exception):
    """A recording that cannot be replayed at all, with the reason."""


@dataclass(frozen=True, slots=True)
class FieldDifference:
    """One field of one tick that came out differently."""

    tick: int
    t_s: float
    field: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"tick {self.tick} at {self.t_s:.3f} s: {self.field}\n  before  {self.before}\n  after   {self.after}"


@dataclass(slots=True)
class ReplayOutcome:
    """What a replay found."""

    steps: int = 0
    ticks: int = 0
    duration_s: float = 0.0
    cut: bool = False
    """The recording ends in a damaged or unfinished record."""
    damaged: tuple[str, ...] = ()
    """Files of the run that are not what they were when it ended."""
    never_kept: str = ""
    """Files of the run that the disk had no room for, and why: it may have gone on."""
    rows_compared: int = 0
    writes_compared: int = 0
    differences: list[FieldDifference] = field(default_factory=list)
    """In the order of the steps; writes have the link as ``field``."""
    different: int = 0
    """Differences in all, kept or not."""
    fault: str = ""
    """The app gave up."""
    unproven: int = 0
    """Signatures, tags and verdicts that were taken from the recording: a replay has no key, and checks no cryptography."""
    versions: str = ""
    """Who recorded and who replayed it, when it was not the same version."""
    moved: list[str] = field(default_factory=list)
    """Recorded settings that contradicted each other where this program has one, and which of them gave way."""

    @property
    def identical(self) -> bool:
        return not self.different and not self.fault and not self.damaged


def replay(
    run_dir: Path,
    *,
    changes: Sequence[str] = (),
    tolerant: bool = False,
    on_tick: Callable[[Snapshot], None] | None = None,
) -> ReplayOutcome:
    """Replay a run directory. Raises ReplayError when there is nothing to replay.

    ``changes`` (key=value) to the recorded settings show what they would have done; one of ``vessel`` takes that file as it is
    now in place of the recorded hull. ``tolerant``: the recording is from
    another kind of machine or Python: see ``nearly`` for what may differ; writes are not compared by checksum.
    """
    compile_early()
    path = run_dir / "inputs.bin" if run_dir.is_dir() else run_dir
    if run_dir.is_dir() and not path.exists():
        raise ReplayError(f"{run_dir}: holds no recording (inputs.bin); give a run's folder")
    try:
        reader = InputReader(path)
    except (OSError, InputsError) as error:
        raise ReplayError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    try:
        return _Replay(reader, changes, tolerant, on_tick, path.parent).run()
    except InputsError as error:
        raise ReplayError(f"{path}: {error}") from None
    finally:
        reader.close()


class _Replay:
    """One replay under way."""

    def __init__(
        self,
        reader: InputReader,
        changes: Sequence[str],
        tolerant: bool,
        on_tick: Callable[[Snapshot], None] | None,
        run_dir: Path,
    ) -> None:
        if not _described(reader.meta):
            raise ReplayError(f"{run_dir / 'inputs.bin'}: the recording ends before its own description")
        self._reader = reader
        self._run_dir = run_dir
        self._sent: SentFrames | None = None
        self._telemetry = [str(link["name"]) for link in reader.meta.get("links", []) if not link.get("keep")]
        self._tolerant = tolerant
        self._on_tick = on_tick
        self._rows = control_rows(run_dir)
        self._row: tuple[int, bytes] | None = None
        self._step: InputStep | None = None
        self._links = ReplayLinks(reader)
        self._store = ReplayStore(reader)
        self._archive = ReplayArchive()
        self._clock = FrameClock()
        self._witness = ReplayWitness() if reader.meta.get("witness") else None
        self._next_link = iter(self._links.links)
        self.outcome = ReplayOutcome(damaged=digests.damaged(run_dir), never_kept=digests.never_kept(run_dir))
        self.app = self._build(reader.meta, changes)
        self.app.recorder = self

    def _build(self, meta: Mapping[str, Any], changes: Sequence[str]) -> App:
        """The app as it was. Raises ReplayError when this version cannot make it, ConfigError for senseless changes."""
        try:
            recorded, hull = copy.deepcopy(dict(meta["settings"])), copy.deepcopy(dict(meta["vessel"]))
            self.outcome.moved = carry_over(recorded, hull)
            settings = known_settings(recorded, changes)
            return build_app(
                settings,
                make_link=self._make_link,
                store=self._store,
                archive=self._archive,
                witness=self._witness,
                vessel=load_vessel(settings.vessel) if _names_vessel(changes) else vessel_of(hull),
                identity=_identity(meta["identity"]),
                board_seen=bool(meta.get("board_seen", True)),
                keeps_voyage=bool(meta.get("keeps_voyage", False)),
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ReplayError(
                f"what was recorded is none of this program's vessels ({error}); {self.versions}"
            ) from None

    @property
    def versions(self) -> str:
        """Who recorded it, and who replays it."""
        return f"recorded by {_maker(self._reader.meta)}, replayed by {_maker(made_by())}"

    def _make_link(self, name: str, url: str, **options: object) -> Link:
        link = next(self._next_link, None)
        if link is None or link.name != name:
            raise ReplayError(
                f"the settings want a link {name!r} where the recording has {link.name if link else 'none'!r}"
            )
        return link

    def run(self) -> ReplayOutcome:
        outcome = self.outcome
        for step in self._reader.steps():
            self._step = step
            self._clock.move(step.utc_us, step.now_us)
            self._links.load(step)
            self._store.load(step)
            if self._witness is not None:
                self._witness.load(step)
            self._archive.load([Fetched(*each) for each in step.fetched])
            try:
                self._perform(step)
            except AppFaultError as error:
                outcome.fault = str(error)
                break
            except request_json.NoRequestError as error:
                raise ReplayError(f"step {step.number}: {error}; {self.versions}") from None
            self._links.finish()
            outcome.steps += 1
            outcome.duration_s = step.now_us * 1e-6
            outcome.writes_compared += sum(len(writes) for writes in step.writes.values())
            self._take_write_differences(step)
        outcome.cut = self._reader.cut
        if self._reader.damaged and "inputs.bin" not in outcome.damaged:
            outcome.damaged = (*outcome.damaged, "inputs.bin")
        outcome.unproven = 0 if self._witness is None else self._witness.said
        if _maker(made_by() | self._reader.meta) != _maker(made_by()):
            outcome.versions = self.versions
        return outcome

    def _perform(self, step: InputStep) -> None:
        for text in step.submitted:
            body, station = request_json.loads(text)
            self.app.submit(body, station=station)
        if step.kind == "tick":
            self.app.tick(step.now_us, late_s=step.late_s, load=step.load)
        elif step.kind == "pump":
            self.app.pump(step.now_us)
        else:
            self.app.shutdown(step.now_us)

    # ---- the app's recorder -------------------------------------------------------------------------------------

    def tick(self, snapshot: Snapshot) -> None:
        self.outcome.ticks += 1
        if self._on_tick is not None:
            self._on_tick(snapshot)
        before = self._row_of(snapshot.tick)
        if before is None:
            return
        self.outcome.rows_compared += 1
        after = control_row(snapshot)
        if before != after:
            self._compare(snapshot, fields_of(before), fields_of(after))

    def order(self, t_us: int, fields: dict[str, Any]) -> None:
        """Orders are inputs' own, and follow from them."""

    def drain_texts(self) -> list[tuple[Severity, str]]:
        return [(Severity(severity), text) for severity, text in self._step.told] if self._step else []

    # ---- comparing ----------------------------------------------------------------------------------------------

    def _row_of(self, tick: int) -> bytes | None:
        """The recorded row of a tick; None when it was never written (a cut) or has been rotated away."""
        while self._row is None or self._row[0] < tick:
            self._row = next(self._rows, None)
            if self._row is None:
                self._rows = iter(())
                return None
        return self._row[1] if self._row[0] == tick else None

    def _compare(self, snapshot: Snapshot, before: list[str], after: list[str]) -> None:
        # an older run's row ends earlier
        for name, was, now in zip(COLUMNS, before, after, strict=False):
            if was != now and not (self._tolerant and nearly(name, was, now)):
                self._note(FieldDifference(snapshot.tick, snapshot.t_us * 1e-6, name, was or "none", now or "none"))

    def _take_write_differences(self, step: InputStep) -> None:
        for found in self._links.differences if not self._tolerant else ():
            for what, before, after in self._told(step, found):
                self._note(FieldDifference(self.outcome.ticks, found.now_us * 1e-6, what, before, after))
        self._links.differences.clear()

    def _told(self, step: InputStep, found: Difference) -> list[tuple[str, str, str]]:
        """Say what differs in a write: for the first few on a MAVLink link, by message and field."""
        plain = [(f"written to {found.link}", found.before, found.after)]
        if found.link not in self._telemetry or len(self.outcome.differences) >= WORDED_DIFFERENCES:
            return plain
        if self._sent is None:
            system_id = int(self._reader.meta["settings"]["system"]["system_id"])
            self._sent = SentFrames(self._run_dir, system_id)
        before = self._sent.of(self._telemetry.index(found.link), self._clock.stamp_us)
        worded = [(f"{found.link}: {what}", was, now) for what, was, now in tell(before, found.data)]
        return worded or plain

    def _note(self, difference: FieldDifference) -> None:
        self.outcome.different += 1
        if len(self.outcome.differences) < MAX_DIFFERENCES:
            self.outcome.differences.append(difference)


def known_settings(data: Mapping[str, Any], overrides: Sequence[str] = ()) -> Settings:
    """Return the vessel's part of recorded settings (a simulator's recording has more), with ``key=value`` changes.

    Raises ReplayError for recorded keys that this program does not know, ConfigError for changes that make no sense.
    """
    kept = copy.deepcopy(dict(data))
    kept.pop(_SIMULATOR_S, None)
    # A program that knew no depth memory had none.
    kept.setdefault("depth", {}).setdefault("memory", {"enabled": False})
    # Nor did it look how far away a plan lies.
    kept["mission"] = {"first_distance_m": 100_000.0, "leg_distance_m": 100_000.0, **kept.get("mission", {})}
    refuse_unknown(Settings, kept, "settings")
    mistakes = [mistake for item in overrides if (mistake := override(kept, item))]
    try:
        settings = Settings.model_validate(kept)
    except ValidationError as error:
        raise ConfigError("recorded settings", mistakes + [explain(item) for item in error.errors()]) from None
    if mistakes:
        raise ConfigError("--set", mistakes)
    return settings


def refuse_unknown(model: type[BaseModel], data: Mapping[str, Any], what: str) -> None:
    """Raise ReplayError for recorded keys that this program neither knows nor carries over (``companion.settings.moved``)."""
    try:
        model.model_validate(data)
    except ValidationError as error:
        strange = [item for item in error.errors() if item["type"] == "extra_forbidden"]
        names = [f"{'.'.join(map(str, item['loc']))} = {item.get('input')!r}" for item in strange]
        if names:
            raise ReplayError(
                f"the recorded {what} hold what this program does not know: {', '.join(names)}; "
                "replay with the version that recorded it"
            ) from None


def _described(meta: Mapping[str, Any]) -> bool:
    """Whether the first record holds what a replay cannot do without."""
    links = meta.get("links")
    return (
        isinstance(meta.get("settings"), dict)
        and isinstance(links, list)
        and all(isinstance(link, dict) and {"name", "datagrams"} <= link.keys() for link in links)
    )


def _maker(meta: Mapping[str, Any]) -> str:
    return f"version {meta.get('version', 'unknown')} on {meta.get('python', 'CPython')}"


def _names_vessel(changes: Sequence[str]) -> bool:
    return any(item.partition("=")[0].strip() == "vessel" for item in changes)


def vessel_of(data: Mapping[str, Any]) -> VesselConfig:
    """Return a recorded hull. Raises ReplayError, or ``ValueError``, where it is none of this program's."""
    refuse_unknown(VesselConfig, data, "hull")
    return VesselConfig.model_validate(data)


def _identity(data: Mapping[str, Any]) -> Identity:
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in data.items()}
    return Identity(**fields)


def summary(outcome: ReplayOutcome, wall_s: float) -> str:
    """Say in a few lines what a replay found."""
    out = io.StringIO()
    speed = outcome.duration_s / wall_s if wall_s > 0 else 0.0
    print(
        f"{outcome.ticks} ticks, {outcome.duration_s:.1f} s replayed in {wall_s:.1f} s ({speed:.0f}x real time); "
        f"{outcome.rows_compared} control rows and {outcome.writes_compared} writes compared",
        file=out,
    )
    if outcome.unproven:
        print(
            f"{outcome.unproven} signatures, tags and verdicts on them as recorded: cryptography was not checked",
            file=out,
        )
    if outcome.versions:
        print(f"{outcome.versions}: a difference may be a change of the program or of its Python", file=out)
    for text in outcome.moved:
        print(f"one value now where the recording has two: {text}", file=out)
    if outcome.cut:
        print("the recording ends in an unfinished record; everything before it was replayed", file=out)
    if outcome.never_kept:
        print(f"the run may have gone on; it was not all kept: {outcome.never_kept}", file=out)
    if outcome.damaged:
        print(f"damaged since it was recorded: {', '.join(outcome.damaged)}", file=out)
    if outcome.fault:
        print(f"the app gave up: {outcome.fault}", file=out)
    if outcome.differences:
        print(f"{outcome.different} differences; the first of each kind:", file=out)
        first: dict[str, FieldDifference] = {}
        for difference in outcome.differences:
            first.setdefault(difference.field, difference)
        for difference in itertools.islice(first.values(), 10):
            print(difference, file=out)
    elif not outcome.fault and not outcome.damaged:
        compared = outcome.rows_compared or outcome.writes_compared
        print("identical" if compared else "nothing in it to compare", file=out)
    return out.getvalue().rstrip()

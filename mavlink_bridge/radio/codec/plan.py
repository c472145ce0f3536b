"""Plans in few bytes, rebuilt bit for bit: what the far side needs to make the very same MISSION_ITEM_INTs.

Fields equal to what the codebook or the last item of the same command leads to expect cost one bit for all of them.
Positions are differences from a predicted one; the first is sent modulo a cell around the vessel, which both ends
know well enough. Sixteen bits of CRC over the items stand at the head: a decoder that resolves a position to the
wrong cell, or meets a fault of ours, refuses the plan. Home never crosses the air.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

from fastcrc import crc16

from ...language.requests import PlanItem, PlanKind
from ...mavlink.wire.cmd import Cmd
from .bits import BitReader, BitsError, BitWriter, float_bits
from .wire import PLAN_COMMANDS, PLAN_FRAMES, PLAN_KIND

MAX_ITEMS: Final = 2000
LEAST_BITS: Final = 4
"""What an item takes at least: a command without a place that differs in nothing from the one before it."""
_NAN: Final = float("nan")
_EXPECTED: Final[dict[int, tuple[int, tuple[float, float, float, float]]]] = {
    Cmd.WAYPOINT: (3, (0.0, 0.0, 0.0, _NAN)),
    Cmd.LOITER_UNLIM: (3, (0.0, 0.0, 0.0, _NAN)),
    Cmd.LOITER_TURNS: (3, (1.0, 0.0, 0.0, 0.0)),
    Cmd.LOITER_TIME: (3, (0.0, 0.0, 0.0, 0.0)),
    Cmd.RETURN_TO_LAUNCH: (2, (0.0, 0.0, 0.0, 0.0)),
    Cmd.DO_CHANGE_SPEED: (2, (1.0, 0.0, -1.0, 0.0)),
    Cmd.NAV_DELAY: (2, (0.0, -1.0, -1.0, -1.0)),
}
"""Frame and parameters that ground stations send when the operator changes nothing."""
_PLACED: Final = (Cmd.WAYPOINT, Cmd.LOITER_UNLIM, Cmd.LOITER_TURNS, Cmd.LOITER_TIME, Cmd.DO_ORBIT)
"""Navigation commands that carry a position."""
_FIRST_AREA: Final = Cmd.FENCE_RETURN_POINT
_BEYOND_AREAS: Final = 6000
"""MAVLink keeps the numbers between for fences and rally points, which all have a place."""
_CELL_BITS: Final = (20, 24, 32)
"""Widths of a first position sent modulo: cells of 11.7 km, 187 km, everything."""
_PREDICTORS: Final = 4
"""0: the last position; 1, 2, 3: and the last step, the step before it backwards, the step four before."""
Position = tuple[int, int]


class PlanCodecError(ValueError):
    """A plan that cannot be encoded or was not decoded: one sentence."""


def check_of(items: Sequence[PlanItem]) -> int:
    """CRC-16 over the items' MAVLink bytes."""
    return int(crc16.ibm_3740(b"".join(_image(item) for item in items)))


def _image(item: PlanItem) -> bytes:
    params = b"".join(map(float_bits, (item.param1, item.param2, item.param3, item.param4, item.z)))
    return params + struct.pack("<iiHBB", item.x, item.y, item.command, item.frame, item.autocontinue)


def encode_plan(kind: PlanKind, items: Sequence[PlanItem], near_e7: Position | None) -> bytes:
    """Encode the items of a plan. ``near_e7``: where the vessel is, as last known, degrees * 1e7; None = send the first position whole.

    Raises PlanCodecError for more than 2000 items or a field that MAVLink cannot hold.
    """
    if len(items) > MAX_ITEMS:
        raise PlanCodecError(f"{len(items)} items, the radio link takes {MAX_ITEMS}")
    try:
        head = BitWriter()
        head.put(check_of(items), 16)
        head.put(PLAN_KIND.number(kind), PLAN_KIND.bits)
        head.unsigned(len(items), 2)
        if not items:
            return head.bytes()
        best = min((_attempt(items, near_e7, predictor) for predictor in range(_PREDICTORS)), key=len)
    except (struct.error, OverflowError, ValueError) as error:
        raise PlanCodecError(f"an item holds a value that MAVLink cannot carry: {error}") from None
    head.extend(best)
    return head.bytes()


def _attempt(items: Sequence[PlanItem], near_e7: Position | None, predictor: int) -> BitWriter:
    """Encode with one predictor of positions and the best order for its differences."""
    steps = _differences(items, near_e7, predictor)
    k = min(range(2, 18), key=lambda order: sum(_cost(x, order) + _cost(y, order) for x, y in steps))
    writer = BitWriter()
    coder = _Items(near_e7)
    coder.choose(predictor, k)
    at = 0
    while at < len(items):
        run = coder.run_length(items, at)
        if run:
            writer.flag(True)
            writer.unsigned(run - 1, 2)
            for item in items[at : at + run]:
                coder.write_place(writer, item)
        else:
            writer.flag(False)
            coder.write(writer, items[at])
        at += max(run, 1)
    return writer


def _cost(value: int, k: int) -> int:
    code = (value << 1 if value >= 0 else (-value << 1) - 1) + (1 << k)
    return 2 * code.bit_length() - k - 1


def _differences(items: Sequence[PlanItem], near_e7: Position | None, predictor: int) -> list[Position]:
    track = _Track(predictor)
    found: list[Position] = []
    for item in items:
        if item.x == 0 and item.y == 0:
            continue
        guess = track.guess()
        if guess is not None:
            found.append((item.x - guess[0], item.y - guess[1]))
        track.note((item.x, item.y))
    return found


def decode_plan(data: bytes, near_e7: Position | None) -> tuple[PlanKind, tuple[PlanItem, ...]]:
    """Rebuild a plan. Raises PlanCodecError, and never returns items that differ from those encoded."""
    try:
        reader = BitReader(data)
        check = reader.get(16)
        kind = PLAN_KIND.member(reader.get(PLAN_KIND.bits))
        count = reader.unsigned(2)
        if count > MAX_ITEMS:
            raise PlanCodecError(f"{count} items, the radio link takes {MAX_ITEMS}")
        items: list[PlanItem] = []
        if count:
            coder = _Items(near_e7)
            while len(items) < count:
                items += coder.read_run(reader) if reader.flag() else [coder.read(reader)]
        right = len(items) == count and check_of(items) == check
    except (BitsError, ValueError, struct.error, OverflowError) as error:
        raise PlanCodecError(f"the plan cannot be decoded: {error}") from None
    if not right:
        raise PlanCodecError("the decoded plan is not the one that was sent")
    return kind, tuple(items)


class _Track:
    """Predicts the next position from those before it."""

    def __init__(self, predictor: int) -> None:
        self._points: list[Position] = []
        self.predict_by(predictor)

    def predict_by(self, predictor: int) -> None:
        self.predictor = predictor
        self._back = (0, 1, 2, 4)[predictor]
        self._sign = -1 if predictor == 2 else 1

    def guess(self) -> Position | None:
        points = self._points
        if not points:
            return None
        last = points[-1]
        back = self._back
        if back == 0 or len(points) <= back:
            return last
        one, two = points[-back - 1], points[-back]
        return last[0] + self._sign * (two[0] - one[0]), last[1] + self._sign * (two[1] - one[1])

    def note(self, point: Position) -> None:
        self._points.append(point)


class _Items:
    """The state that encoder and decoder share while they walk through a plan."""

    def __init__(self, near_e7: Position | None) -> None:
        self._near = near_e7
        self._track = _Track(0)
        self._k = 0
        self._told = False
        self._last: dict[int, PlanItem] = {}
        self._command: int | None = None

    def _expected(self, command: int) -> PlanItem:
        if command in self._last:
            return self._last[command]
        frame, params = _EXPECTED.get(command, (3, (0.0, 0.0, 0.0, 0.0)))
        return PlanItem(command, frame, *params, x=0, y=0, z=0.0)

    def _remember(self, item: PlanItem) -> None:
        self._last[item.command] = item
        self._command = item.command

    def choose(self, predictor: int, k: int) -> None:
        """Set the plan's predictor and the order of its differences; they stand before the second position."""
        self._track.predict_by(predictor)
        self._k = k

    # writing

    def write(self, writer: BitWriter, item: PlanItem) -> None:
        writer.flag(item.command == self._command)
        if item.command != self._command:
            _write_command(writer, item.command)
        expected = self._expected(item.command)
        same = _image(replace(expected, x=item.x, y=item.y)) == _image(item)
        writer.flag(same)
        if not same:
            _write_fields(writer, item, expected)
        self._write_position(writer, item)
        self._remember(item)

    def run_length(self, items: Sequence[PlanItem], start: int) -> int:
        """How many items from here differ from the last one in their position only, and have one."""
        last = self._last.get(self._command) if self._command is not None else None
        if last is None or not _usually_placed(last.command):
            return 0
        run = 0
        for item in items[start:]:
            if not (item.x or item.y) or _image(replace(last, x=item.x, y=item.y)) != _image(item):
                break
            run += 1
        return run

    def write_place(self, writer: BitWriter, item: PlanItem) -> None:
        """An item of a run: its position only."""
        self._write_point(writer, item)
        self._remember(item)

    def _write_position(self, writer: BitWriter, item: PlanItem) -> None:
        placed = item.x != 0 or item.y != 0
        writer.flag(placed == _usually_placed(item.command))
        if placed:
            self._write_point(writer, item)

    def _write_point(self, writer: BitWriter, item: PlanItem) -> None:
        guess = self._track.guess()
        if guess is None:
            self._write_first(writer, item)
        else:
            if not self._told:
                writer.put(self._track.predictor, 2)
                writer.put(self._k - 2, 4)
                self._told = True
            writer.signed(item.x - guess[0], self._k)
            writer.signed(item.y - guess[1], self._k)
        self._track.note((item.x, item.y))

    def _write_first(self, writer: BitWriter, item: PlanItem) -> None:
        """Low bits only when the vessel is so near that its own position completes them, with room for it to have moved."""
        width = next(bits for bits in _CELL_BITS if bits == 32 or _is_near(item, self._near, 1 << bits))
        writer.put(_CELL_BITS.index(width), 2)
        for value in (item.x, item.y):
            writer.put(value & ((1 << width) - 1), width)

    # reading

    def read(self, reader: BitReader) -> PlanItem:
        command = self._command if reader.flag() else _read_command(reader)
        if command is None:
            raise BitsError("no command to repeat")
        expected = self._expected(command)
        item = expected if reader.flag() else _read_fields(reader, expected)
        x, y = self._read_position(reader, command)
        item = replace(item, x=x, y=y)
        self._remember(item)
        return item

    def read_run(self, reader: BitReader) -> list[PlanItem]:
        last = self._last.get(self._command) if self._command is not None else None
        run = reader.unsigned(2) + 1
        if last is None or run > MAX_ITEMS:
            raise BitsError("nothing to repeat")
        found = []
        for _ in range(run):
            x, y = self._read_point(reader)
            last = replace(last, x=x, y=y)
            self._remember(last)
            found.append(last)
        return found

    def _read_position(self, reader: BitReader, command: int) -> Position:
        return self._read_point(reader) if reader.flag() == _usually_placed(command) else (0, 0)

    def _read_point(self, reader: BitReader) -> Position:
        guess = self._track.guess()
        if guess is None:
            point = self._read_first(reader)
        else:
            if not self._told:
                self.choose(reader.get(2), reader.get(4) + 2)
                self._told = True
                guess = self._track.guess() or guess
            point = guess[0] + reader.signed(self._k), guess[1] + reader.signed(self._k)
        self._track.note(point)
        return point

    def _read_first(self, reader: BitReader) -> Position:
        index = reader.get(2)
        if index >= len(_CELL_BITS):
            raise BitsError("no such cell")
        width = _CELL_BITS[index]
        if width < 32 and self._near is None:
            raise PlanCodecError("the vessel does not know where it is; send the plan with whole positions")
        low = (reader.get(width), reader.get(width))
        near = self._near or (0, 0)
        return _nearest(low[0], near[0], width), _nearest(low[1], near[1], width)


def _usually_placed(command: int) -> bool:
    """Navigation commands carry a position, others do not."""
    return command in _PLACED or _FIRST_AREA <= command < _BEYOND_AREAS


def _is_near(item: PlanItem, near: Position | None, cell: int) -> bool:
    return near is not None and max(abs(item.x - near[0]), abs(item.y - near[1])) < cell // 4


def _nearest(low: int, near: int, width: int) -> int:
    """The number with these low bits that is nearest to ``near``; of 32 bits, as signed."""
    cell = 1 << width
    if width == 32:
        return low - cell if low >= cell // 2 else low
    return near + (low - near + cell // 2) % cell - cell // 2


def _write_command(writer: BitWriter, command: int) -> None:
    known = command in PLAN_COMMANDS
    writer.put(PLAN_COMMANDS.index(command) if known else 15, 4)
    if not known:
        writer.put(command, 16)


def _read_command(reader: BitReader) -> int:
    index = reader.get(4)
    return reader.get(16) if index == 15 else PLAN_COMMANDS[index]


_REALS: Final[tuple[tuple[str, Callable[[PlanItem], float]], ...]] = (
    ("param1", lambda item: item.param1),
    ("param2", lambda item: item.param2),
    ("param3", lambda item: item.param3),
    ("param4", lambda item: item.param4),
    ("z", lambda item: item.z),
)


def _write_fields(writer: BitWriter, item: PlanItem, expected: PlanItem) -> None:
    plain = item.frame == expected.frame and item.autocontinue == expected.autocontinue
    writer.flag(plain)
    if not plain:
        _write_frame(writer, item)
    for _, field in _REALS:
        same = float_bits(field(item)) == float_bits(field(expected))
        writer.flag(same)
        if not same:
            writer.real(field(item))


def _read_fields(reader: BitReader, expected: PlanItem) -> PlanItem:
    item = expected if reader.flag() else _read_frame(reader, expected)
    changed = {name: reader.real() for name, _ in _REALS if not reader.flag()}
    return replace(item, **changed)  # type: ignore[arg-type]


def _write_frame(writer: BitWriter, item: PlanItem) -> None:
    """Frame by codebook (7 = as it is), autocontinue by one bit for 1 (else as it is)."""
    known = item.frame in PLAN_FRAMES
    writer.put(PLAN_FRAMES.index(item.frame) if known else 7, 3)
    if not known:
        writer.put(item.frame, 8)
    writer.flag(item.autocontinue == 1)
    if item.autocontinue != 1:
        writer.put(item.autocontinue, 8)


def _read_frame(reader: BitReader, expected: PlanItem) -> PlanItem:
    index = reader.get(3)
    frame = reader.get(8) if index == 7 else PLAN_FRAMES[index]
    return replace(expected, frame=frame, autocontinue=1 if reader.flag() else reader.get(8))

"""What the tests of the IMC codec share: captured packets, random messages, and the names that fields have on the wire."""

from __future__ import annotations

import functools
import re
from pathlib import Path

from hypothesis import strategies as st

from mavlink_bridge import imc
from mavlink_bridge.imc.fields import LongRaw, LongText, ManyMessages, OneMessage, Scalar
from mavlink_bridge.imc.layout import items_of

CAPTURED_FILE = Path(__file__).parent / "data" / "imc" / "captured.txt"
INTEGERS = {"B": (0, 0xFF), "b": (-128, 127), "H": (0, 0xFFFF), "h": (-32768, 32767)}
INTEGERS |= {"I": (0, 0xFFFF_FFFF), "i": (-(2**31), 2**31 - 1)}
UNITS = re.compile(r"_(rad|radps|m|mps|s|ms|pct|v|a|rpm|mib|dm|cmps|deg|kn)$")
OTHER_NAMES = {"sys_a": "sys_a", "aperture_rad": "angaperture"}
SIMPLE = (imc.Goto, imc.Loiter, imc.StationKeeping, imc.Rows, imc.Teleoperation, imc.EntityParameter)
MANOEUVRES = (imc.Goto, imc.Loiter, imc.StationKeeping, imc.Rows, imc.FollowPath, imc.Teleoperation)
ARGUMENTS = (imc.PlanSpecification, imc.PlanStatistics, imc.FollowPath, imc.SetEntityParameters, *SIMPLE)


def captured() -> dict[str, bytes]:
    lines = CAPTURED_FILE.read_text(encoding="utf-8").splitlines()[1:]
    return {name: bytes.fromhex(text) for name, _, text in (line.rpartition(": ") for line in lines)}


def wire_name(field: str) -> str:
    return OTHER_NAMES.get(field) or UNITS.sub("", field)


@functools.cache
def messages(wanted: type[imc.Message], depth: int = 3) -> st.SearchStrategy[imc.Message]:
    """Any message of a class, with random fields; messages inside messages, a few levels deep."""
    return st.builds(
        wanted, **{name: _values(wanted, name, kind, depth) for name, kind in imc.kinds_of(wanted).items()}
    )


def _values(wanted: type[imc.Message], name: str, kind: object, depth: int) -> st.SearchStrategy:
    match kind:
        case Scalar("f"):
            return st.floats(width=32, allow_nan=False)
        case Scalar("d"):
            return st.floats(allow_nan=False)
        case Scalar(code):
            return st.integers(*INTEGERS[code])
        case LongText():
            return st.text(st.characters(min_codepoint=1, max_codepoint=0x3FF), max_size=8)
        case LongRaw():
            return st.binary(max_size=20)
        case OneMessage():
            return st.none() | _any(MANOEUVRES if wanted is imc.PlanManeuver else ARGUMENTS, depth)
        case ManyMessages():
            only = items_of(wanted)[name]
            held = SIMPLE if only is imc.Message else (only,)
            return st.lists(_any(held, depth), max_size=2 if depth else 0).map(tuple)
    raise AssertionError(kind)


def _any(wanted: tuple[type[imc.Message], ...], depth: int) -> st.SearchStrategy:
    return st.one_of([messages(each, depth - 1) for each in wanted]) if depth > 0 else st.nothing()

"""Both byte orders against pyimclsts, LSTS' own codec in Python, which makes its classes from our table written as IMC's XML."""

from __future__ import annotations

import importlib
import itertools
import subprocess
import sys
from xml.sax.saxutils import quoteattr

import pytest

from mavlink_bridge import imc
from mavlink_bridge.imc.fields import LongRaw, LongText, ManyMessages, OneMessage, Scalar
from mavlink_bridge.imc.layout import items_of
from mavlink_bridge.imc.messages import ALL
from tests.imc_messages import wire_name

pytest.importorskip("pyimclsts")

TYPES = {"B": "uint8_t", "b": "int8_t", "H": "uint16_t", "h": "int16_t", "I": "uint32_t", "i": "int32_t"}
TYPES |= {"f": "fp32_t", "d": "fp64_t"}
OTHERS = {LongText(): "plaintext", LongRaw(): "rawdata", OneMessage(): "message", ManyMessages(): "message-list"}
HEADER = {"sync": "uint16_t", "mgid": "uint16_t", "size": "uint16_t", "timestamp": "fp64_t"}
HEADER |= {"src": "uint16_t", "src_ent": "uint8_t", "dst": "uint16_t", "dst_ent": "uint8_t"}
TEXT = "<description>x</description>"


def tag(element: str, inside: str = "", /, **attributes: object) -> str:
    words = " ".join(f"{key}={quoteattr(str(value))}" for key, value in attributes.items())
    return f"<{element} {words}>{inside}</{element}>"


def named(kind: str, name: str, inside: str = TEXT, **more: object) -> str:
    return tag(kind, inside, name=name, abbrev=name, **more)


def schema() -> str:
    """Our table as the file that the other codec reads."""
    kinds = {name: "float" if name.startswith("fp") else "integer" for name in (*TYPES.values(), "int64_t")}
    kinds |= dict.fromkeys(OTHERS.values(), "other")
    types = "".join(tag("type", f"<description>{text}</description>", name=name) for name, text in kinds.items())
    header = "".join(
        named("field", name, type=kind, **({"value": "0xFE54"} if name == "sync" else {}))
        for name, kind in HEADER.items()
    )
    value = named("value", "A", id=0)
    enums = "".join(named("def", name, value, prefix="X") for name in ("E1", "E2"))
    categories = "".join(tag("category", name=name) for name in ("Core", "Other"))
    parts = {"types": types, "header": header, "footer": named("field", "crc16", type="uint16_t")}
    parts |= {"enumerations": enums, "bitfields": enums, "categories": categories}
    body = "".join(
        f"<{name}>{TEXT * (name in ('types', 'header', 'footer'))}{inside}</{name}>" for name, inside in parts.items()
    )
    return f"<messages>{body}{''.join(map(message, ALL))}</messages>"


def message(wanted: type[imc.Message]) -> str:
    told = [
        named("field", wire_name(name), "", type=TYPES[kind.code] if isinstance(kind, Scalar) else OTHERS[kind])
        for name, kind in imc.kinds_of(wanted).items()
    ]
    return named("message", wanted.__name__, TEXT + "".join(told), id=wanted.NUMBER, category="Core")


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """The classes that the other codec makes."""
    folder = tmp_path_factory.mktemp("pyimclsts")
    (folder / "IMC.xml").write_text(schema(), encoding="utf-8")
    subprocess.run([sys.executable, "-m", "pyimclsts.extract"], cwd=folder, check=True, capture_output=True)
    sys.path.insert(0, str(folder))
    try:
        yield importlib.import_module("pyimc_generated").messages
    finally:
        sys.path.remove(str(folder))


def filled(wanted: type[imc.Message], count: itertools.count) -> imc.Message:
    """A message with another value in each field."""

    def value(name: str, kind: object) -> object:
        match kind:
            case Scalar(code):
                return next(count) % 100 + (0.25 if code in "fd" else 0)
            case LongText():
                return f"text{next(count)}"
            case LongRaw():
                return bytes((next(count) % 256, 1))
            case OneMessage():
                return filled(imc.Loiter, count)
            case _:
                only = items_of(wanted)[name]
                return (filled(imc.EntityParameter if only is imc.Message else only, count),) * 2

    return wanted(**{name: value(name, kind) for name, kind in imc.kinds_of(wanted).items()})


def as_other(message: imc.Message, classes):
    found = getattr(classes, type(message).__name__)()
    for name in imc.kinds_of(type(message)):
        value = getattr(message, name)
        if isinstance(value, imc.Message):
            value = as_other(value, classes)
        elif isinstance(value, tuple):
            value = [as_other(item, classes) for item in value]
        setattr(found, wire_name(name), value)
    return found


@pytest.mark.parametrize("big_endian", [False, True])
def test_every_message_has_the_bytes_of_lsts_own_python_codec(other, big_endian):
    for wanted in ALL:
        sample = filled(wanted, itertools.count(1))
        theirs = as_other(sample, other).pack(is_big_endian=big_endian, src=0x4001, src_ent=3, dst=0x2877, dst_ent=9)
        packet = imc.decode(theirs)
        assert (packet.message, packet.big_endian) == (sample, big_endian)
        assert imc.encode(packet) == theirs

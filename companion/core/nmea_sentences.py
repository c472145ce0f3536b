"""The table of sentences: a checked body in, one typed part in SI units out.

pynmea2 lays out the fields and reads plain numbers; ``nmea_position`` and ``nmea_attitude`` add what it lacks: bounds,
blank = unknown, leap seconds, strict coordinates, and sentences that it does not know.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Final

import pynmea2

from companion.core import nmea_attitude as attitude, nmea_position as position
from companion.core.nmea_fields import MalformedError, Part

Decoder = Callable[[str], Part | None]

_TALKER: Final[dict[str, Callable[[Any], Part | None]]] = {
    "ZDA": position.zda,
    "GGA": position.gga,
    "GNS": position.gns,
    "GLL": position.gll,
    "RMC": position.rmc,
    "VTG": position.vtg,
    "GST": position.gst,
    "GSA": position.gsa,
    "HDT": attitude.hdt,
    "THS": attitude.ths,
    "HDG": attitude.hdg,
    "HDM": attitude.hdm,
    "ROT": attitude.rot,
    "DPT": attitude.dpt,
    "DBT": attitude.dbt,
    "DBS": attitude.dbs,
    "DBK": attitude.dbk,
    "XDR": attitude.xdr,
}
_PROPRIETARY: Final[dict[str, tuple[Any, Callable[[Any], Part | None]]]] = {
    "PASHR": (pynmea2.ash.ASH, attitude.pashr),
    "PSAT": (attitude.SATHPR, attitude.psat),
    "PSXN": (pynmea2.sxn.SXN, attitude.psxn),
    "PTNL": (pynmea2.tnl.TNL, attitude.ptnl),
}

KINDS: Final = frozenset(_TALKER) | frozenset(_PROPRIETARY)
"""The formatters understood: three letters, or the proprietary name."""


def kind_of(address: str) -> tuple[str, str]:
    """Split an address field into (talker, formatter): ``GPGGA`` to GP, GGA; proprietary ones have no talker."""
    if address in _PROPRIETARY:
        return "", address
    if len(address) == 5:
        return address[:2], address[2:]
    return "", address


class _Fields:
    """A sentence's fields by pynmea2's names. pynmea2 finds each by a failed look-up first, at five times the cost."""

    __slots__ = ("data", "talker")

    def __init__(self, talker: str) -> None:
        self.talker = talker
        self.data: list[str] = []


@cache
def _fields_of(layout: Any) -> type[_Fields]:
    places = {field[1]: _field(index, *field[2:3]) for index, field in enumerate(layout.fields)}
    return type(f"{layout.__name__}Fields", (_Fields,), {"__slots__": (), **places})


def _field(index: int, convert: Callable[[str], Any] | None = None) -> property:
    """A field as pynmea2 gives it: missing ones are blank; converted ones None when blank, and text when they cannot be."""

    def plain(sentence: _Fields) -> str:
        data = sentence.data
        return data[index] if index < len(data) else ""

    def converted(sentence: _Fields) -> Any:
        text = plain(sentence)
        if not text or convert is None:
            return None
        try:
            return convert(text)
        except Exception:
            return text

    return property(plain if convert is None else converted)


def decoder_of(address: str) -> Decoder | None:
    """Return the function that decodes the fields behind an address (the text after its comma); None when unknown.

    The function returns None for a sentence that says nothing here, and raises MalformedError for an impossible field.
    """
    talker, kind = kind_of(address)
    if not talker:
        return _proprietary(address) if address in _PROPRIETARY else None
    handler = _TALKER.get(kind)
    if handler is None:
        return None
    # One sentence object per address: making one costs more than its field access.
    sentence = _fields_of(pynmea2.TalkerSentence.sentence_types[kind])(talker)

    def decode(fields: str) -> Part | None:
        if "_" in fields:
            raise MalformedError("underscore")  # Python would take 1_0 for a number
        sentence.data = fields.split(",")
        return handler(sentence)

    return decode


def _proprietary(address: str) -> Decoder:
    layout, handler = _PROPRIETARY[address]
    lead = "R" if address == "PASHR" else ""

    def decode(text: str) -> Part | None:
        if "_" in text:
            raise MalformedError("underscore")
        fields = text.split(",")
        if lead and fields[0][:6].isdigit():
            fields[0] = "000000.00"  # pynmea2 knows the attitude form by a time of two or three decimals only
        return handler(layout(address[1:4], [lead, *fields]))

    return decode


def parse(body: str) -> Part | None:
    """Decode one checked body. None when the sentence is unknown or says nothing here; raises MalformedError."""
    address, _, fields = body.partition(",")
    decode = decoder_of(address)
    return None if decode is None else decode(fields)

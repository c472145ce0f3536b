"""The table of sentences: a checked body in, one typed part in SI units out.

pynmea2 says which field is where; ``nmea_position`` and ``nmea_attitude`` read the fields and add what it lacks: bounds,
blank = unknown, leap seconds, strict coordinates, and sentences that it does not know.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any, Final

import pynmea2

from . import attitude, position
from .fields import Part, PassedOverError

Decoder = Callable[[list[str], int], Part | None]

_EPOCH: Final[dict[str, tuple[Callable[[str, Any], Part], str]]] = {
    "ZDA": (position.zda, "timestamp year month day"),
    "GGA": (position.gga, "timestamp lat lat_dir lon lon_dir gps_qual num_sats horizontal_dil altitude geo_sep"),
    "GNS": (position.gns, "timestamp lat lat_dir lon lon_dir mode_indicator num_sats hdop altitude geo_sep"),
    "GLL": (position.gll, "timestamp lat lat_dir lon lon_dir status faa_mode"),
    "RMC": (
        position.rmc,
        "timestamp datestamp status lat lat_dir lon lon_dir spd_over_grnd true_course mag_variation mag_var_dir mode_indicator",
    ),
    "VTG": (position.vtg, "true_track true_track_sym spd_over_grnd_kts spd_over_grnd_kmph faa_mode"),
    "GST": (position.gst, "timestamp std_dev_latitude std_dev_longitude std_dev_altitude"),
    "GSA": (position.gsa, "mode_fix_type vdop"),
}
"""What reads a sentence, given its talker and the fields that it names: one as it is, several as a tuple."""
_MEASURED: Final[dict[str, tuple[Callable[[int, Any], Part | None], str]]] = {
    "HDT": (attitude.hdt, "heading hdg_true"),
    "THS": (attitude.ths, "heading mode_indicator"),
    "HDG": (attitude.hdg, "heading deviation dev_dir variation var_dir"),
    "HDM": (attitude.hdm, "heading"),
    "ROT": (attitude.rot, "rate_of_turn status"),
    "DPT": (attitude.dpt, "depth offset range"),
    "DBT": (attitude.depth, "depth_feet depth_meters depth_fathoms"),
    "DBS": (attitude.depth, "depth_feet depth_meter depth_fathoms"),
    "DBK": (attitude.depth, "depth_feet depth_meters depth_fathoms"),
    "XDR": (attitude.xdr, ""),
}
"""The same for those that give a measurement by themselves; they get its time instead of the talker. No name: all fields."""
_ABSENT: Final = {"GLL": {"status": "A"}}
"""What a field means that is not even blank: before version 2.0 of the standard GLL ended with the longitude."""
_PROPRIETARY: Final[dict[str, tuple[Any, Callable[[int, Any], Part | None]]]] = {
    "PASHR": (pynmea2.ash.ASH, attitude.pashr),
    "PSAT": (attitude.SATHPR, attitude.psat),
    "PSXN": (pynmea2.sxn.SXN, attitude.psxn),
    "PTNL": (pynmea2.tnl.TNL, attitude.ptnl),
    "PSTI": (attitude.STI036, attitude.psti),
    "PTNTHTM": (attitude.TNTHTM, attitude.ptnthtm),
}

KINDS: Final = frozenset(_EPOCH) | frozenset(_MEASURED) | frozenset(_PROPRIETARY)
"""The formatters understood: three letters, or the proprietary name."""
EPOCH_KINDS: Final = frozenset(_EPOCH)
"""Those that become an ``EpochPart``; the others are a measurement."""
DEPTH_KINDS: Final = frozenset({"DBT", "DPT", "DBK", "DBS"})
"""Those that become a ``Distance``."""


def kind_of(address: str) -> tuple[str, str]:
    """Split an address field into (talker, formatter): ``GPGGA`` to GP, GGA; proprietary ones have no talker."""
    if address in _PROPRIETARY:
        return "", address
    if len(address) == 5:
        return address[:2], address[2:]
    return "", address


def decoder_of(address: str) -> Decoder | None:
    """Return the function that decodes an address's fields (its own first) measured at a time; None when unknown.

    The function may add blank fields. It returns None when nothing is measured, and raises PassedOverError for a sentence
    that says nothing here, BadFieldError for an impossible field.
    """
    talker, kind = kind_of(address)
    if not talker:
        return _proprietary(address) if address in _PROPRIETARY else None
    if kind in _EPOCH:
        return _of_epoch(talker, kind)
    return _measured(kind) if kind in _MEASURED else None


def _of_epoch(talker: str, kind: str) -> Decoder:
    read, wanted = _EPOCH[kind]
    return _picking(kind, wanted, lambda t_us, picked: read(talker, picked))


def _measured(kind: str) -> Decoder:
    read, wanted = _MEASURED[kind]
    return _picking(kind, wanted, read)


def _picking(kind: str, wanted: str, read: Callable[[int, Any], Part | None]) -> Decoder:
    """Make a decoder that hands ``read`` the wanted fields; those that a sentence does not have are blank or as ``_ABSENT`` says."""
    # pynmea2 has a blank inside one name, and does not count the address.
    names = ["", *(field[1].replace(" ", "") for field in pynmea2.TalkerSentence.sentence_types[kind].fields)]
    absent = _ABSENT.get(kind, {})
    blanks = [absent.get(name, "") for name in names]
    full = len(blanks)
    pick: Callable[[list[str]], Any]
    pick = itemgetter(*map(names.index, wanted.split())) if wanted else itemgetter(slice(1, None))

    def decode(fields: list[str], t_us: int) -> Part | None:
        if len(fields) < full:
            fields += blanks[len(fields) :]
        return read(t_us, pick(fields))

    return decode


def _proprietary(address: str) -> Decoder:
    layout, read = _PROPRIETARY[address]
    lead = "R" if address == "PASHR" else ""

    def decode(fields: list[str], t_us: int) -> Part | None:
        fields = fields[1:] or [""]
        if lead and fields[0][:6].isdigit():
            fields[0] = "000000.00"  # pynmea2 knows the attitude form by a time of two or three decimals only
        return read(t_us, layout(address[1:4], [lead, *fields]))

    return decode


def parse(body: str) -> Part | None:
    """Decode one checked body. None when it is unknown or says nothing here; raises BadFieldError."""
    fields = body.split(",")
    decode = decoder_of(fields[0])
    try:
        return None if decode is None else decode(fields, 0)
    except PassedOverError:
        return None

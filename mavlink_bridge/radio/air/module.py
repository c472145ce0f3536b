"""The radio module's configuration protocol: what to send, what the answer means, and which bytes of the settings may
change.

AA FA and an instruction; no checksum (LoRa611PRO and its sisters). Rule: read the block, change only known bytes at
known offsets, write the same length back, read again, compare. A model or length that is not known is refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from .profile import RadioProfile, channel_mhz

if TYPE_CHECKING:
    from .codes import ModuleCodes

READ_MODEL: Final = b"\xaa\xfa\xaa"
READ_BLOCK: Final = b"\xaa\xfa\x01"
FACTORY_RESET: Final = b"\xaa\xfa\x02"
_WRITE: Final = b"\xaa\xfa\x03"
BAUD: Final = 9600
"""Serial rate in configuration mode, 8N1, whatever the data rate is."""
_END: Final = b"\r\n"
BAUDS: Final = (1200, 2400, 4800, 9600, 14400, 19200, 38400, 57600, 76800, 115200)
PARITIES: Final = ("none", "odd", "even")
ROLES: Final = ("node", "router", "node+router")
KNOWN_MODELS: Final = ("LORA611PRO", "LORA6100PRO", "LORA6500PRO")
PRO_BLOCK: Final = 33
KNOWN_LENGTHS: Final = (33, 34)
"""33 bytes as published; 34 with a flag for listen-before-talk at the end (inferred for version 3.1_E)."""


KEY_AT: Final = 17
KEY_BYTES: Final = 16
_BAND_868: Final = 3


class ModuleError(Exception):
    """Why the module cannot be configured: one sentence with the mend."""


@dataclass(frozen=True, slots=True)
class ModuleField:
    """One setting in the block, under the name that the vendor's tool shows."""

    name: str
    at: int
    size: int
    value: bytes
    shown: str


def read_line(answer: bytes) -> bytes | None:
    """The answer without its line end, None while it is not whole."""
    return answer[: -len(_END)] if answer.endswith(_END) else None


def check_model(answer: bytes) -> str:
    """Return the model's name and version. Raises ModuleError for one that is not known."""
    text = answer.decode("ascii", "replace").strip()
    if not text:
        raise ModuleError("the module does not answer: SET low (configuration mode)? right port? 9600 baud?")
    if not text.upper().replace("-", "").startswith(KNOWN_MODELS):
        raise ModuleError(f"model {text!r} is not known ({', '.join(KNOWN_MODELS)} are); nothing was written")
    return text


def check_block(block: bytes) -> bytes:
    """Return the block. Raises ModuleError for a length that is not known."""
    if len(block) not in KNOWN_LENGTHS:
        raise ModuleError(f"the settings have {len(block)} bytes; known are {KNOWN_LENGTHS}; nothing was written")
    return block


def fields(block: bytes, codes: ModuleCodes | None = None) -> list[ModuleField]:
    """Take a block apart. ``codes``: what was learned of its numbers."""
    rate = codes.rates.get(block[2]) if codes is not None else None
    mhz = codes.mhz.get((block[1], block[0])) if codes is not None else None

    def field(name: str, at: int, size: int, shown: str) -> ModuleField:
        return ModuleField(name, at, size, block[at : at + size], shown)

    found = [
        field("Channel", 0, 1, f"{block[0]}{_frequency(block) if mhz is None else f' ({mhz:.2f} MHz)'}"),
        field("Band", 1, 1, {1: "433", 2: "470", 3: "868", 4: "915"}.get(block[1], f"code {block[1]}")),
        field("Data Rate", 2, 1, f"index {block[2]}" if rate is None else f"{rate} bit/s (index {block[2]})"),
        field("Power", 3, 1, str(block[3])),
        field("Baud Rate", 4, 1, str(BAUDS[block[4]]) if block[4] < len(BAUDS) else f"code {block[4]}"),
        field("Data bit", 5, 1, {1: "7", 2: "8"}.get(block[5], f"code {block[5]}")),
        field("Stop", 6, 1, str(block[6])),
        field("Parity", 7, 1, PARITIES[block[7] - 1] if 1 <= block[7] <= 3 else f"code {block[7]}"),
        field("NET ID", 8, 4, block[8:12].hex().upper()),
        field("NODE ID", 12, 2, block[12:14].hex().upper()),
        field("Working Mode", 14, 1, "Mesh" if block[14] else "Non Mesh"),
        field("Mode", 15, 1, ROLES[block[15]] if block[15] < len(ROLES) else f"code {block[15]}"),
        field("Encryption", 16, 1, "on" if block[16] else "off"),
        field("AES key", KEY_AT, KEY_BYTES, "set" if any(block[KEY_AT : KEY_AT + KEY_BYTES]) else "unset"),
    ]
    if len(block) > PRO_BLOCK:
        found.append(field("LBT", PRO_BLOCK, 1, "on" if block[PRO_BLOCK] else "off"))
    return found


def _frequency(block: bytes) -> str:
    """The frequency behind a channel, where it is known: of the 868 MHz band, by the steps of a sister module."""
    if block[1] != _BAND_868:
        return ""
    return f" ({channel_mhz(block[0]):.2f} MHz, inferred)"


def wanted(profile: RadioProfile, side: str, block: bytes) -> bytes:
    """The block as the profile wants it for ``side`` ('vessel' or 'shore'); bytes that the profile does not name stay.

    Raises ModuleError for what this block cannot hold.
    """
    if profile.baud not in BAUDS:
        raise ModuleError(f"baud = {profile.baud}: the module knows {', '.join(map(str, BAUDS))}")
    if profile.lbt and len(block) <= PRO_BLOCK:
        raise ModuleError("lbt = true: this module's settings have no such flag")
    node = profile.node_vessel if side == "vessel" else profile.node_shore
    new = bytearray(block)
    new[0:2] = bytes((profile.channel, profile.band))
    new[2] = block[2] if profile.rate_index is None else profile.rate_index
    new[3] = profile.power_level
    new[4:8] = bytes(
        (
            BAUDS.index(profile.baud),
            {7: 1, 8: 2}[profile.data_bits],
            profile.stop_bits,
            PARITIES.index(profile.parity) + 1,
        )
    )
    new[8:12] = bytes.fromhex(profile.net_id)
    new[12:14] = bytes.fromhex(node)
    new[14:17] = bytes((int(profile.mesh), ROLES.index(profile.role), int(profile.encryption)))
    if len(block) > PRO_BLOCK:
        new[PRO_BLOCK] = int(profile.lbt)
    return bytes(new)


def write_command(block: bytes) -> bytes:
    return _WRITE + block


def differences(have: bytes, want: bytes) -> list[str]:
    """Say field by field what differs, empty when nothing does."""
    pairs = zip(fields(have), fields(want), strict=True)
    return [f"{one.name}: {one.shown}, wanted {two.shown}" for one, two in pairs if one.value != two.value]

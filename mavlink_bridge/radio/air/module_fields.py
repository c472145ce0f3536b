"""Single settings of a radio module by name: what ``companion lora set`` changes, and how each is written into the block.

Values are those that the vendor's tool shows. What is not named keeps its bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from .module import BAUDS, KEY_AT, KEY_BYTES, PARITIES, PRO_BLOCK, ROLES, ModuleError


class SettingError(ModuleError):
    """A setting that was meant otherwise: one sentence with the mend."""


_SWITCH: Final = ("off", "on")
_CHOICES: Final[dict[str, tuple[int, dict[str, int]]]] = {
    "band": (1, {"433": 1, "470": 2, "868": 3, "915": 4}),
    "baud": (4, {str(rate): code for code, rate in enumerate(BAUDS)}),
    "data_bits": (5, {"7": 1, "8": 2}),
    "stop_bits": (6, {"1": 1, "2": 2}),
    "parity": (7, {name: code for code, name in enumerate(PARITIES, 1)}),
    "mesh": (14, {name: code for code, name in enumerate(_SWITCH)}),
    "role": (15, {name: code for code, name in enumerate(ROLES)}),
    "encryption": (16, {name: code for code, name in enumerate(_SWITCH)}),
    "lbt": (PRO_BLOCK, {name: code for code, name in enumerate(_SWITCH)}),
}
"""Place, and code of each value."""
_NUMBERS: Final = {"channel": (0, 255), "rate_index": (2, 9), "power": (3, 7)}
"""Place and highest value."""
_HEX: Final = {"net_id": (8, 4), "node_id": (12, 2)}
"""Place and number of bytes."""
NAMES: Final = (*_NUMBERS, *_CHOICES, *_HEX, "key_file")


def changed(block: bytes, name: str, value: str, read_key: Callable[[str], bytes]) -> bytes:
    """The block with one setting changed; ``read_key`` reads a key file. Raises SettingError for what is
    no such setting or value, ModuleError for what this block cannot hold.
    """
    if name in _NUMBERS:
        at, most = _NUMBERS[name]
        if not value.isascii() or not value.isdigit() or int(value) > most:
            raise _wrong(name, value, f"a whole number from 0 to {most}")
        return _put(block, at, bytes((int(value),)))
    if name in _CHOICES:
        at, codes = _CHOICES[name]
        if value not in codes:
            raise _wrong(name, value, f"one of {', '.join(codes)}")
        if at >= len(block):
            raise ModuleError(f"{name}: this module's settings have no such flag; nothing was written")
        return _put(block, at, bytes((codes[value],)))
    if name in _HEX:
        at, size = _HEX[name]
        try:
            data = bytes.fromhex(value)
        except ValueError:
            data = b""
        if len(data) != size:
            raise _wrong(name, value, f"{2 * size} hexadecimal digits")
        return _put(block, at, data)
    if name == "key_file":
        key = read_key(value)
        if len(key) != KEY_BYTES:
            raise _wrong(name, value, f"a file of {KEY_BYTES} bytes, not {len(key)}")
        return _put(block, KEY_AT, key)
    raise SettingError(f"{name}: no such setting; there are {', '.join(NAMES)}; nothing was written")


def without_key(block: bytes) -> bytes:
    """A block that may be shown."""
    return _put(block, KEY_AT, bytes(KEY_BYTES))


def _put(block: bytes, at: int, data: bytes) -> bytes:
    return block[:at] + data + block[at + len(data) :]


def _wrong(name: str, value: str, right: str) -> SettingError:
    return SettingError(f"{name} = {value}: give {right}; nothing was written")

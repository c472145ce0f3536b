"""Files that describe the vessel to stations: component metadata (JSON) and the packed parameter list.

``general.json`` and ``parameters.json`` follow MAVLink's component metadata schemas; ``@PARAM/param.pck`` is ArduPilot's packed
list, which QGroundControl and MAVProxy ask for first (types: 4 = float; flag 1 = a default follows).
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from typing import Any, Final
from urllib.parse import parse_qs

from ..persona import ParamInfo
from ..wire.codec import dialect
from ..wire.mapping import boot_ms
from .ftp import File, crc32
from .params import EndpointParams

GENERAL: Final = "general.json"
PARAMETERS: Final = "parameters.json"
PACKED: Final = "@PARAM/param.pck"
_PARAMETER_TYPE: Final = 1
_FLOAT: Final = 4
_HAS_DEFAULT: Final = 1 << 4
_MAGIC: Final = 0x671B
_MAGIC_WITH_DEFAULTS: Final = 0x671C


def files(params: EndpointParams) -> Mapping[str, File]:
    """The files of one endpoint, by name without a leading slash."""
    return {
        GENERAL: lambda _: general(params),
        PARAMETERS: lambda _: parameters(params),
        PACKED: lambda query: param_pack(params, query),
    }


def component_metadata(params: EndpointParams, now_us: int) -> Any:
    """COMPONENT_METADATA: where the general file is, and the CRC of the bytes that FTP will deliver."""
    return dialect.MAVLink_component_metadata_message(
        time_boot_ms=boot_ms(now_us), file_crc=crc32(general(params)), uri=f"mftp:///{GENERAL}".encode()
    )


def general(params: EndpointParams) -> bytes:
    entry = {"type": _PARAMETER_TYPE, "uri": f"mftp:///{PARAMETERS}", "fileCrc": crc32(parameters(params))}
    return _json({"version": 1, "metadataTypes": [entry]})


def parameters(params: EndpointParams) -> bytes:
    """What each parameter means; without present values, so that stations can keep the file."""
    return _json({"version": 1, "parameters": [_describe(info) for info in _all(params)]})


def _describe(info: ParamInfo) -> dict[str, Any]:
    described: dict[str, Any] = {
        "name": info.name,
        "type": "Float",
        "shortDesc": info.text,
        "group": info.group or "Vessel",
        "category": "Standard",
        "rebootRequired": not info.live,
        "readOnly": info.read_only,
        "decimalPlaces": 0 if info.increment == 1.0 else 4,
    }
    optional = {
        "units": info.unit or None,
        "min": info.minimum,
        "max": info.maximum,
        "default": info.default,
        "increment": info.increment,
    }
    if info.choices:
        described["values"] = [{"value": value, "description": name} for value, name in info.choices]
    return described | {
        key: value
        for key, value in optional.items()
        if isinstance(value, str) or (value is not None and math.isfinite(value))
    }


def param_pack(params: EndpointParams, query: str) -> bytes:
    """The packed list. The query may hold start, count and withdefaults, as ArduPilot's."""
    options = {key: values[0] for key, values in parse_qs(query).items()}
    with_defaults = options.get("withdefaults") == "1"
    chosen = _all(params)[_number(options.get("start"), 0) :]
    chosen = chosen[: _number(options.get("count"), len(chosen))]
    magic = _MAGIC_WITH_DEFAULTS if with_defaults else _MAGIC
    out = bytearray(struct.pack("<HHH", magic, len(chosen), len(params)))
    previous = b""
    for info in chosen:
        name = info.name.encode("ascii", "replace")[:16]
        out += _entry(info, name, _common(previous, name), with_defaults)
        previous = name
    return bytes(out)


def _entry(info: ParamInfo, name: bytes, common: int, with_defaults: bool) -> bytes:
    default = info.default if with_defaults else None
    shows_default = default is not None and math.isfinite(default) and default != info.value
    rest = name[common:]
    head = bytes((_FLOAT | (_HAS_DEFAULT if shows_default else 0), common | (len(rest) - 1) << 4))
    tail = struct.pack("<f", default) if shows_default else b""
    return head + rest + struct.pack("<f", info.value) + tail


def _common(previous: bytes, name: bytes) -> int:
    """Length of the shared start; at least one character of the name is always written."""
    limit = min(len(previous), len(name) - 1, 15)
    return next((index for index in range(limit) if previous[index] != name[index]), max(limit, 0))


def _number(text: str | None, default: int) -> int:
    return int(text) if text is not None and text.isascii() and text.isdigit() and len(text) < 6 else default


def _all(params: EndpointParams) -> list[ParamInfo]:
    return [info for info in map(params.at, range(len(params))) if info is not None]


def _json(content: dict[str, Any]) -> bytes:
    return json.dumps(content, separators=(",", ":"), allow_nan=False).encode()

"""The MAVLink dialect of this project: pymavlink's ``all`` plus the fields and messages that it lacks.

``dialect`` is a private copy of that module's names in which the messages of ``_ADDED_FIELDS`` have their newer extension
fields and the messages of ``_ADDED_MESSAGES`` exist. Everything else imports the dialect from ``codec``; nothing outside
this file knows which library it comes from. Definitions: MAVLink common.xml, July 2026. Extension fields do not
take part in CRC_EXTRA and stand at the end of the payload in their declared order, so an older peer reads what it knows.
"""

from __future__ import annotations

import struct
from types import ModuleType
from typing import Any, Final

from pymavlink.dialects.v20 import all as _library

from ...crc import mcrf4xx

_FORMAT: Final = {
    "char": "s",
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
    "double": "d",
}

_ADDED_FIELDS: Final[dict[str, tuple[tuple[str, str], ...]]] = {
    "MISSION_COUNT": (("uint32_t", "opaque_id"),),
    "MISSION_ACK": (("uint32_t", "opaque_id"),),
    "MISSION_CURRENT": (("uint32_t", "mission_id"), ("uint32_t", "fence_id"), ("uint32_t", "rally_points_id")),
    "TIMESYNC": (("uint8_t", "target_system"), ("uint8_t", "target_component")),
}

_ADDED_MESSAGES: Final[dict[str, tuple[int, tuple[tuple[str, str, int], ...]]]] = {
    # name: (id, fields in declared order as (type, name, array length or 0))
    "FIGURE_EIGHT_EXECUTION_STATUS": (
        361,
        (
            ("uint64_t", "time_usec", 0),
            ("float", "major_radius", 0),
            ("float", "minor_radius", 0),
            ("float", "orientation", 0),
            ("uint8_t", "frame", 0),
            ("int32_t", "x", 0),
            ("int32_t", "y", 0),
            ("float", "z", 0),
        ),
    ),
    "PROTOCOL_VERSION": (
        300,
        (
            ("uint16_t", "version", 0),
            ("uint16_t", "min_version", 0),
            ("uint16_t", "max_version", 0),
            ("uint8_t", "spec_version_hash", 8),
            ("uint8_t", "library_version_hash", 8),
        ),
    ),
    "COMPONENT_METADATA": (
        397,
        (("uint32_t", "time_boot_ms", 0), ("uint32_t", "file_crc", 0), ("char", "uri", 100)),
    ),
}


def _size(field_type: str) -> int:
    return struct.calcsize("<" + _FORMAT[field_type])


def crc_extra(name: str, ordered: list[tuple[str, str, int]]) -> int:
    """CRC_EXTRA of a message: the CRC of its name and of its base fields in wire order (MAVLink serialization guide)."""
    text = bytearray(f"{name} ".encode())
    for field_type, field, length in ordered:
        text += f"{field_type} {field} ".encode()
        if length:
            text.append(length)
    crc = mcrf4xx(bytes(text))
    return (crc & 0xFF) ^ (crc >> 8)


def _with_fields(base: Any, added: tuple[tuple[str, str], ...]) -> Any:
    """Derive a message class from ``base`` with extension fields appended, each with the default 0."""
    names = [name for _, name in added if name not in base.fieldnames]
    if not names:
        return base
    types = {name: kind for kind, name in added}

    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        count = len(base.fieldnames)
        extra = dict(zip(names, args[count:], strict=False))
        base.__init__(self, *args[:count], **{key: value for key, value in kwargs.items() if key not in names})
        self._fieldnames = type(self).fieldnames
        for name in names:
            setattr(self, name, extra.get(name, kwargs.get(name, 0)))

    return _make_class(
        base.__name__,
        base,
        fieldnames=[*base.fieldnames, *names],
        ordered_fieldnames=[*base.ordered_fieldnames, *names],
        fieldtypes=[*base.fieldtypes, *(types[name] for name in names)],
        orders=[*base.orders, *range(len(base.fieldnames), len(base.fieldnames) + len(names))],
        lengths=[*base.lengths, *(1 for _ in names)],
        array_lengths=[*base.array_lengths, *(0 for _ in names)],
        unpacker=struct.Struct(base.unpacker.format + "".join(_FORMAT[types[name]] for name in names)),
        __init__=init,
    )


def _new_message(name: str, message_id: int, fields: tuple[tuple[str, str, int], ...]) -> Any:
    """Make a message class like the library's own, from its declared fields."""
    ordered = sorted(fields, key=lambda field: -_size(field[0]))
    names = [field[1] for field in fields]
    ordered_names = [field[1] for field in ordered]

    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        _library.MAVLink_message.__init__(self, message_id, name)
        self._fieldnames = names
        self._instance_field, self._instance_offset = None, -1
        values = dict(zip(names, args, strict=False)) | kwargs
        for kind, field, _ in fields:
            value = values[field]
            if kind == "char":
                setattr(self, f"_{field}_raw", value)
                value = value.partition(b"\0")[0].decode(errors="replace")
            setattr(self, field, value)

    return _make_class(
        f"MAVLink_{name.lower()}_message",
        _library.MAVLink_message,
        id=message_id,
        msgname=name,
        name=name,
        fieldnames=names,
        ordered_fieldnames=ordered_names,
        fieldtypes=[field[0] for field in fields],
        fielddisplays_by_name={},
        fieldenums_by_name={},
        fieldunits_by_name={},
        orders=[ordered_names.index(field) for field in names],
        # a char array counts as one value to struct, as in the library's classes
        lengths=[1 if kind == "char" else max(1, length) for kind, _, length in ordered],
        array_lengths=[length for _, _, length in ordered],
        crc_extra=crc_extra(name, ordered),
        unpacker=struct.Struct("<" + "".join(f"{length or ''}{_FORMAT[kind]}" for kind, _, length in ordered)),
        instance_field=None,
        instance_offset=-1,
        __init__=init,
    )


def _make_class(class_name: str, base: Any, /, **members: Any) -> Any:
    made: Any = type(class_name, (base,), members)
    made.native_format = bytearray(made.unpacker.format.encode())
    made.__doc__ = base.__doc__
    return made


def _build() -> Any:
    module = ModuleType("mavlink_bridge.dialect", __doc__)
    module.__dict__.update({key: value for key, value in vars(_library).items() if not key.startswith("__")})
    classes: dict[int, Any] = dict(_library.mavlink_map)
    for name, added in _ADDED_FIELDS.items():
        message_id = getattr(_library, f"MAVLINK_MSG_ID_{name}")
        classes[message_id] = _with_fields(classes[message_id], added)
    for name, (message_id, fields) in _ADDED_MESSAGES.items():
        if message_id not in classes:
            classes[message_id] = _new_message(name, message_id, fields)
        setattr(module, f"MAVLINK_MSG_ID_{name}", message_id)
    for message_class in classes.values():
        setattr(module, message_class.__name__, message_class)
    module.__dict__["mavlink_map"] = classes
    return module


dialect: Final[Any] = _build()
"""Message classes (``MAVLink_..._message``), ids (``MAVLINK_MSG_ID_...``), enum values, and ``mavlink_map`` by id."""

messages: Final[dict[int, Any]] = dialect.mavlink_map
"""Message class by message id."""

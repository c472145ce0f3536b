"""The vessel's parameters as a console shows them: by part, values as text; and the file by which the console knows them.

A part is a section of the settings file. The table is the settings' own, so that file, names, units and bounds cannot differ from what the
vessel has. A vehicle with another autopilot has no such table: its parameters are grouped by the beginning of their names.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final
from xml.sax.saxutils import escape, quoteattr

from mavlink_bridge.mavlink.persona import ParamInfo, ParamTable

_TRUE: Final = {"true": 1.0, "false": 0.0}


class ParamSections:
    """Sections and their parameters. ``table``: our settings' parameters; None for a foreign vehicle."""

    def __init__(self, table: ParamTable | None) -> None:
        self._infos: dict[str, ParamInfo] = {}
        for number in range(len(table) if table is not None else 0):
            info = table.at(number) if table is not None else None
            if info is not None:
                self._infos[info.name] = info
        self.values: dict[str, float] = {}
        """As the vehicle last told them."""

    @property
    def sections(self) -> Sequence[str]:
        """Names of the parts in the table, in alphabetical order; they never change."""
        return sorted({section_of(info) for info in self._infos.values()})

    def values_of(self, section: str) -> list[tuple[str, str]]:
        """(name, value) of a part's parameters, as far as the vehicle has told them."""
        return [(name, self.text(name)) for name in sorted(self.values) if self._section(name) == section]

    def text(self, name: str) -> str:
        value = self.values.get(name, math.nan)
        return "" if math.isnan(value) else f"{value:.7g}"

    def wanted(self, section: str, name: str, text: str) -> float | str:
        """The number that a console's text means for a parameter, or why it is refused."""
        known = name in self._infos or name in self.values
        if not known or self._section(name) != section:
            return f"{section} has no parameter {name}"
        try:
            value = _TRUE[text.strip().lower()] if text.strip().lower() in _TRUE else float(text)
        except ValueError:
            return f'{name}: "{text}" is no number'
        return value if math.isfinite(value) else f"{name}: a finite number is needed"

    def _section(self, name: str) -> str:
        info = self._infos.get(name)
        return section_of(info) if info is not None else name.partition("_")[0]


def section_of(info: ParamInfo) -> str:
    """What a console calls the part that a parameter belongs to."""
    return info.group.replace("_", " ").title() or "Vessel"


def parameter_file(system: str, table: ParamTable) -> str:
    """The console's parameter file of this vessel (``conf/params/NAME.en_US.xml`` there): the same table, as XML."""
    infos = [info for info in map(table.at, range(len(table))) if info is not None]
    by_section: dict[str, list[ParamInfo]] = {}
    for info in infos:
        by_section.setdefault(section_of(info), []).append(info)
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f"<config name-i18n={quoteattr(system)} name={quoteattr(system)}>",
    ]
    for section in sorted(by_section):
        lines.append(f"  <section name={quoteattr(section)} name-i18n={quoteattr(section)}>")
        for info in sorted(by_section[section], key=lambda each: each.name):
            lines += _param(info)
        lines.append("  </section>")
    return "\n".join([*lines, "</config>", ""])


def _param(info: ParamInfo) -> list[str]:
    fields: Mapping[str, str] = {
        "name-i18n": info.name,
        "type": "integer" if info.increment == 1.0 else "real",
        "visibility": "user",
        "scope": "global",
        "default": "" if info.default is None or math.isnan(info.default) else f"{info.default:.7g}",
        "units": info.unit,
        "desc": info.text if info.live else f"{info.text} (at the next start)",
        "min": "" if info.minimum is None else f"{info.minimum:.7g}",
        "max": "" if info.maximum is None else f"{info.maximum:.7g}",
    }
    inner = [f"      <{tag}>{escape(text)}</{tag}>" for tag, text in fields.items() if text]
    return [f"    <param name={quoteattr(info.name)}>", *inner, "    </param>"]

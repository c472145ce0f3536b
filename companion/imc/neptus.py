"""The files by which Neptus knows this vessel: a vehicle definition and a parameter definition, to be copied into its folders.

Without them a console lists and draws the system but cannot command it. The definition offers the manoeuvres that are sailed here
and no others; names of elements and classes are the format's own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final
from xml.sax.saxutils import escape

from mavlink_bridge.mavlink.persona import ParamTable

from .desk import parameter_file
from .settings import ImcSettings

_PLACE: Final = (
    "<point><id>{id}</id><name>{id}</name><coordinate><latitude>0N</latitude><longitude>0E</longitude><depth>0</depth></coordinate>"
    "</point><radiusTolerance>{tolerance}</radiusTolerance>"
)
_SPEED_MPS: Final = 1.2
"""Of a new manoeuvre, until the operator says otherwise."""
_LOITER: Final = (
    "<duration>30</duration><trajectory><radius type='float'>12</radius><radiusTolerance type='float'>2</radiusTolerance>"
    "<type>Circular</type><length type='float'>50</length><bearing type='float'>0</bearing><direction>Clockwise</direction></trajectory>"
)
_ROWS: Final = "<width>100.0</width><length>200.0</length><height>0.0</height><hstep>27.0</hstep><vstep>0.0</vstep><bearing>0.0</bearing>"
_PATTERN: Final = "<width>100.0</width><hstep>20.0</hstep><bearing>0.0</bearing><squareCurve>false</squareCurve>"
_SQUARE: Final = "<width>100.0</width><hstep>50</hstep><bearing>0.0</bearing><firstCurveRight>true</firstCurveRight>"
_MANEUVERS: Final = (
    # element, class, name of its place, name of its speed, what is between them
    ("Goto", "Goto", "finalPoint", "velocity", ""),
    ("Loiter", "Loiter", "basePoint", "velocity", _LOITER),
    (
        "StationKeeping",
        "StationKeeping",
        "basePoint",
        "speed",
        "<duration>0</duration><trajectory><radius type='float'>12</radius></trajectory>",
    ),
    ("Rows", "RowsManeuver", "basePoint", "speed", _ROWS),
    ("FollowPath", "FollowPath", "basePoint", "speed", "<path/>"),
    ("RIPattern", "RIPattern", "basePoint", "speed", _PATTERN),
    ("CrossHatchPattern", "CrossHatchPattern", "basePoint", "speed", _PATTERN),
    ("ExpandingSquarePattern", "ExpandingSquarePattern", "basePoint", "speed", _SQUARE),
)
"""The last three reach the vessel as FollowPath."""


def vehicle_file(settings: ImcSettings) -> str:
    """The vehicle definition. Its address counts only until the console has heard an announcement."""
    name, number = escape(settings.name), f"{settings.imc_id >> 8:02X}:{settings.imc_id & 0xFF:02X}"
    maneuvers = "\n".join(_maneuver(*row) for row in _MANEUVERS)
    host = "127.0.0.1" if settings.listen == "0.0.0.0" else settings.listen
    tcp = str(bool(settings.tcp_port)).lower()
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<system>
  <properties>
    <id>{name}</id>
    <name>{name}</name>
    <type>ASV</type>
    <model>USV</model>
    <appearance>
      <x-size>2</x-size>
      <y-size>1</y-size>
      <z-size>1</z-size>
      <icon-color><r>0</r><g>160</g><b>220</b></icon-color>
    </appearance>
    <limits><valid-zunits>depth</valid-zunits></limits>
    <coordinate-system-label>SNAME</coordinate-system-label>
  </properties>
  <feasibleManeuvers>
{maneuvers}
  </feasibleManeuvers>
  <protocols-supported><protocols/><protocols-args/></protocols-supported>
  <communication-means>
    <comm-mean>
      <name>ethernet</name>
      <type>ethernet</type>
      <host-address>{host}</host-address>
      <protocols>imc</protocols>
      <latency value="100M" unit="bps"/>
      <protocols-args>
        <imc>
          <port>{settings.udp_port}</port>
          <port-tcp>{settings.tcp_port or settings.udp_port}</port-tcp>
          <udp-on>true</udp-on>
          <tcp-on>{tcp}</tcp-on>
          <imc-id>{number}</imc-id>
        </imc>
      </protocols-args>
    </comm-mean>
  </communication-means>
  <consoles>
    <console name="LAUV"><xml-file>../conf/consoles/lauv.ncon</xml-file></console>
  </consoles>
</system>
"""


def _maneuver(element: str, name: str, place: str, speed: str, between: str) -> str:
    where = _PLACE.format(id=f"{element}Point", tolerance=2)
    how_fast = f"<{speed} type='float' unit='m/s' tolerance='1'>{_SPEED_MPS}</{speed}>"
    return (
        f"    <maneuver><{element} kind='automatic'><{place} type='pointType'>{where}</{place}>{between}{how_fast}"
        f"<annotation><documentation>{element}</documentation>"
        f"<implementation-class>pt.lsts.neptus.mp.maneuvers.{name}</implementation-class></annotation></{element}></maneuver>"
    )


def write_files(settings: ImcSettings, params: ParamTable, folder: Path) -> list[Path]:
    """Write both files below ``folder`` where Neptus has them, and return their paths. Raises OSError."""
    definition = folder / "vehicles-defs" / f"10-{settings.name}.nvcl"
    parameters = folder / "conf" / "params" / f"{settings.name}.en_US.xml"
    for path, text in ((definition, vehicle_file(settings)), (parameters, parameter_file(settings.name, params))):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return [definition, parameters]

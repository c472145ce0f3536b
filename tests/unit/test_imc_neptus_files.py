"""The two ways in which Neptus may command the vessel: by its own name with our two files, and as LSTS' own otter without."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from companion.cli import main
from companion.imc.announcing import make_node
from companion.imc.compose import vessel_parameters
from companion.imc.settings import ImcSettings, as_otter
from mavlink_bridge import imc


def announced(settings):
    (packet,) = (
        each
        for _, data in make_node(settings, uid=7).take(0)
        if isinstance((each := imc.decode(data)).message, imc.Announce)
    )
    return packet


def test_by_its_own_name_the_files_and_the_announcement_say_the_same(tmp_path, capsys):
    assert main(["imc", "neptus-files", str(tmp_path)]) == 0
    said = announced(ImcSettings())
    (definition,) = tmp_path.glob("vehicles-defs/*.nvcl")
    root = ET.parse(definition).getroot()
    assert root.findtext("properties/id") == said.message.sys_name == "usv-1"
    high, low = root.findtext(".//imc-id").split(":")
    assert int(high + low, 16) == said.header.source
    assert 0x2800 <= said.header.source <= 0x2BFF, "third parties' surface vessels"
    assert said.message.sys_type == imc.SystemType.USV
    assert root.findtext("properties/type") == "ASV"
    assert root.findtext(".//imc/port") == str(ImcSettings().udp_port)
    assert str(definition) in capsys.readouterr().out


def test_the_definition_offers_what_is_sailed_and_nothing_else(tmp_path):
    assert main(["imc", "neptus-files", str(tmp_path)]) == 0
    root = ET.parse(next(tmp_path.glob("vehicles-defs/*.nvcl"))).getroot()
    offered = {maneuver[0].tag for maneuver in root.findall("feasibleManeuvers/maneuver")}
    patterns = {"RIPattern", "CrossHatchPattern", "ExpandingSquarePattern"}  # sent as FollowPath
    assert offered - patterns == {"Goto", "Loiter", "StationKeeping", "Rows", "FollowPath"}


def test_every_parameter_of_the_vessel_is_in_the_parameter_file(tmp_path):
    assert main(["imc", "neptus-files", str(tmp_path)]) == 0
    root = ET.parse(tmp_path / "conf" / "params" / "usv-1.en_US.xml").getroot()
    assert root.get("name") == "usv-1"
    named = [param.get("name") for section in root.findall("section") for param in section.findall("param")]
    table = vessel_parameters(ImcSettings())
    assert sorted(named) == sorted(table.at(number).name for number in range(len(table)))


def test_as_otter_it_needs_no_files():
    said = announced(as_otter(ImcSettings()))
    assert (said.message.sys_name, said.header.source) == ("otter", 0x0803)

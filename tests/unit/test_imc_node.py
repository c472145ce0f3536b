"""The life of an IMC system: found at once, spoken to at once, each request answered once and to its asker alone."""

from __future__ import annotations

from mavlink_bridge import imc
from mavlink_bridge.imc import Discovery, Outgoing, Tcp, Udp
from mavlink_bridge.imc.node import MAX_ASKED
from tests.imc_messages import captured
from tests.imc_node_rig import BOAT_ID, UTC_S, ConsoleRig, Part, kinds, make_node

S = 1_000_000


def test_it_announces_itself_at_once_and_every_ten_seconds():
    node = make_node()
    sent = [(place, imc.decode(data), at) for at in range(0, 31 * S, S // 2) for place, data in node.take(at)]
    assert [at for _, _, at in sent] == [0, 10 * S, 20 * S, 30 * S]
    assert {place for place, _, _ in sent} == {Discovery()}
    announce = sent[0][1]
    assert (announce.header.source, announce.header.destination, announce.header.utc_s) == (BOAT_ID, 0, UTC_S)
    assert (announce.message.sys_name, announce.message.sys_type) == ("boat", imc.SystemType.USV)
    assert "imc+udp://10.77.0.2:6002/" in announce.message.services
    assert "/uid/77" in announce.message.services


def test_a_console_is_spoken_to_in_the_moment_in_which_it_is_first_heard():
    node = make_node(part := Part())
    console = ConsoleRig(node)
    console.take(0)
    got = console.announce(3 * S)
    assert kinds(got)[:2] == [imc.Announce, imc.Heartbeat]
    assert {place for place, _ in console.got[1:]} == {console.udp}
    assert [asker.name for asker in part.new] == ["ccu-a"]


def test_a_console_heard_before_all_parts_stand_is_greeted_at_once_and_answered_when_they_do():
    """The bridge announces itself a quarter of a second before it is whole; what a console asks meanwhile is not lost."""
    node = make_node(opening=True)
    console = ConsoleRig(node)
    console.take(0)
    assert kinds(console.announce(S // 10))[:2] == [imc.Announce, imc.Heartbeat]
    assert kinds(console.say(imc.EntityList(imc.EntityListOp.QUERY), S // 5)) == []
    assert kinds(console.say(imc.Abort(), S // 5)) == []
    node.add(part := Part())
    node.open(S // 2)
    got = console.take(S // 2)
    reports = [packet.message.list for packet in got if isinstance(packet.message, imc.EntityList)]
    assert reports == ["Daemon=0;Plan Engine=1"]
    assert [type(message) for message, _ in part.asked] == [imc.Abort]
    assert [asker.name for asker in part.new] == ["ccu-a"]
    assert kinds(console.say(imc.Heartbeat(), S)) == [imc.Heartbeat]


def test_a_flood_before_all_parts_stand_is_bounded():
    node = make_node(opening=True)
    console = ConsoleRig(node)
    for number in range(MAX_ASKED + 50):
        console.say(imc.Abort(), number)
    node.add(part := Part())
    node.open(S)
    assert len(part.asked) == MAX_ASKED


def test_a_console_that_asks_before_it_announces_itself_is_answered_where_it_sent_from():
    node = make_node()
    got = ConsoleRig(node).say(imc.EntityList(imc.EntityListOp.QUERY), 0)
    assert imc.EntityList in kinds(got)


def test_a_console_that_sends_each_packet_from_a_new_port_is_answered_where_it_listens():
    """imcpy as the first of two on a computer: its announcement was not heard, and it asks once."""
    console = ConsoleRig(make_node())
    console.say(imc.Heartbeat(), 0, place=Udp(console.host, 40123))
    console.got.clear()
    console.say(imc.EntityList(imc.EntityListOp.QUERY), S, place=Udp(console.host, 40124))
    assert console.udp in {place for place, packet in console.got if isinstance(packet.message, imc.EntityList)}


def test_a_console_that_sends_from_another_port_than_it_listens_on_is_reached_before_it_announces_itself():
    """imcpy sends each packet from a new port."""
    node = make_node()
    console = ConsoleRig(node)
    console.say(imc.Heartbeat(), 0, place=Udp(console.host, 40123))
    assert console.udp in {place for place, _ in console.got}
    console.announce(S)
    console.got.clear()
    console.say(imc.Heartbeat(), 2 * S, place=Udp(console.host, 40124))
    assert {place for place, _ in console.got} == {console.udp}


def test_the_entities_are_told_to_who_asked_once():
    node = make_node(Part("Plan Engine"), Part("Navigation"))
    console, other = ConsoleRig(node), ConsoleRig(node, "10.77.0.9", 0x4002, "ccu-b")
    console.announce(0)
    other.announce(0)
    console.got.clear()
    node.receive(console.packet(imc.EntityList(imc.EntityListOp.QUERY), S), console.udp, S)
    sent = [(place, imc.decode(data)) for place, data in node.take(S)]
    reports = [(place, packet) for place, packet in sent if isinstance(packet.message, imc.EntityList)]
    assert [place for place, _ in reports] == [console.udp]
    answer = reports[0][1]
    assert answer.message == imc.EntityList(imc.EntityListOp.REPORT, "Daemon=0;Plan Engine=1;Navigation=2")
    assert (answer.header.destination, answer.header.destination_entity) == (0x4001, 3)


def test_what_is_for_another_system_is_passed_over():
    node = make_node(part := Part())
    console = ConsoleRig(node)
    console.announce(0)
    console.say(imc.Abort(), S, destination=0x0803)
    assert part.asked == []
    assert node.not_ours == 1
    console.say(imc.Abort(), S)
    console.say(imc.TextMessage("a", "b"), S, destination=imc.BROADCAST)
    assert [(type(message), asker.direct) for message, asker in part.asked] == [
        (imc.Abort, True),
        (imc.TextMessage, False),
    ]


def test_both_byte_orders_are_understood_and_answers_are_little_endian():
    node = make_node(part := Part())
    part.answer = imc.PlanControl(imc.ReplyType.SUCCESS, imc.PlanControlOp.STOP, 9)
    got = ConsoleRig(node).say(imc.PlanControl(request_id=9), 0, big_endian=True)
    answers = [packet for packet in got if isinstance(packet.message, imc.PlanControl)]
    assert [(packet.message.request_id, packet.big_endian) for packet in answers] == [(9, False)]


def test_a_request_over_a_connection_is_answered_on_it_and_state_goes_by_datagram():
    node = make_node(part := Part())
    console = ConsoleRig(node)
    console.announce(0)
    console.got.clear()
    part.answer = imc.PlanControl(imc.ReplyType.SUCCESS)
    connection = Tcp(console.host, 50123)
    data = console.packet(imc.PlanControl(request_id=1), S)
    for at in range(0, len(data), 7):
        node.receive(data[at : at + 7], connection, S)
    part.out.append(Outgoing(imc.VehicleState()))
    console.take(S)
    places = {type(packet.message): place for place, packet in console.got}
    assert places[imc.PlanControl] == connection
    assert places[imc.VehicleState] == console.udp
    node.closed(connection)


def test_a_packet_that_comes_twice_is_taken_once():
    """On both transports, or doubled by the network."""
    node = make_node(part := Part())
    console = ConsoleRig(node)
    data = console.packet(imc.PlanControl(request_id=1), 0)
    for place in (console.udp, console.udp, Tcp(console.host, 50000)):
        node.receive(data, place, 0)
    assert len(part.asked) == 1
    assert node.copies == 2


def test_two_consoles_with_one_id_on_two_hosts_are_two():
    node = make_node(part := Part())
    one, two = ConsoleRig(node, "10.77.0.1"), ConsoleRig(node, "10.77.0.5")
    one.announce(0)
    two.announce(0)
    part.out.append(Outgoing(imc.VehicleState()))
    places = [place for place, data in node.take(S) if type(imc.decode(data).message) is imc.VehicleState]
    assert places == [one.udp, two.udp]


def test_a_silent_console_is_forgotten_and_told_everything_when_it_is_back():
    node = make_node(part := Part())
    console = ConsoleRig(node)
    console.announce(0)
    assert imc.Heartbeat in kinds(console.take(29 * S))
    assert imc.Heartbeat not in kinds([packet for at in range(31, 40) for packet in console.take(at * S)])
    assert imc.Announce in kinds(console.say(imc.Heartbeat(), 41 * S))
    assert len(part.new) == 2
    texts = " / ".join(text for _, text in node.drain_texts())
    assert "is here" in texts
    assert "is silent" in texts


def test_sixteen_seconds_of_silence_of_a_console_and_it_is_greeted_again():
    node = make_node(part := Part())
    console = ConsoleRig(node)
    console.announce(0)
    console.say(imc.Heartbeat(), 16 * S)
    assert len(part.new) == 2


def test_an_announcement_never_sends_our_state_to_a_third_party():
    node = make_node()
    console = ConsoleRig(node)
    console.announce(0, "imc+udp://203.0.113.9:53/;imc+udp://8.8.8.8:53/")
    places = {place for place, _ in node.take(S) if not isinstance(place, Discovery)}
    assert places == {Udp("10.77.0.1", 53)}


def test_of_several_addresses_the_one_that_spoke_is_taken():
    node = make_node()
    console = ConsoleRig(node)
    console.announce(
        0, "neptus://0.0.0.0/uid/1/;imc+udp://192.168.1.1:6001/;imc+udp://10.77.0.1:6004/;imc+tcp://10.77.0.1:6009/;"
    )
    assert {place for place, _ in node.take(S) if not isinstance(place, Discovery)} == {Udp("10.77.0.1", 6004)}


def test_other_vehicles_are_not_sent_our_state():
    node = make_node(part := Part())
    node.receive(captured()["Announce, DUNE"], Udp("10.77.0.8", 30100), 0)
    node.receive(captured()["Heartbeat, DUNE"], Udp("10.77.0.8", 6002), 0)
    part.out.append(Outgoing(imc.VehicleState()))
    assert [place for place, _ in node.take(0)] == [Discovery()]


def test_the_real_consoles_announcement_makes_it_a_console():
    node = make_node()
    node.receive(captured()["Announce, Neptus"], Udp("10.77.0.1", 30100), 0)
    assert Udp("10.77.0.1", 6001) in [place for place, _ in node.take(0)]


def test_strangers_beyond_the_room_do_not_crowd_out_who_is_heard():
    node = make_node(part := Part())
    console = ConsoleRig(node)
    for second in range(20):
        console.say(imc.Heartbeat(), second * S)
        for number in range(100):
            ConsoleRig(node, f"10.78.{second}.{number}", 0x5000 + number, "x").say(imc.Heartbeat(), second * S)
    part.out.append(Outgoing(imc.VehicleState()))
    places = [place for place, _ in node.take(20 * S)]
    assert console.udp in places
    assert len(places) <= 60
    assert node.peers.refused > 0


def test_a_clock_that_is_a_minute_off_is_told_once_and_so_is_its_mending():
    node = make_node()
    console = ConsoleRig(node, ahead_s=60.0)
    for second in range(5):
        console.say(imc.Heartbeat(), second * S)
    told = [text for _, text in node.drain_texts() if "clock" in text]
    assert len(told) == 1
    assert "60 s ahead" in told[0]
    assert "60 s ahead" in node.skews()[0]
    console.ahead_s = 0.5
    for second in range(5, 90):
        console.say(imc.Heartbeat(), second * S)
    assert ["again" in text for _, text in node.drain_texts() if "clock" in text] == [True]
    assert node.skews() == []


def test_how_old_a_request_is_is_told_by_its_senders_own_clock():
    node = make_node(part := Part())
    console = ConsoleRig(node, ahead_s=3600.0)
    console.say(imc.Heartbeat(), 0)
    late = console.packet(imc.PlanControl(), 10 * S)
    console.say(imc.Heartbeat(), 20 * S)
    node.receive(late, console.udp, 25 * S)
    assert 14.9 < part.asked[-1][1].age_s < 15.1


def test_a_computer_that_does_not_know_the_time_takes_a_consoles():
    node = make_node()
    node.utc_ahead_us = None
    console = ConsoleRig(node)
    console.say(imc.Heartbeat(), 5 * S)
    got = console.say(imc.EntityList(imc.EntityListOp.QUERY), 6 * S)
    assert abs(got[-1].header.utc_s - UTC_S - 6) < 0.01


def test_another_system_of_our_id_is_told_and_our_own_echo_is_not():
    node = make_node()
    ((_, own),) = node.take(0)
    node.receive(own, Udp("10.77.0.2", 6002), 0)
    assert node.drain_texts() == []
    twin = ConsoleRig(node, "10.77.0.66", BOAT_ID, "impostor")
    twin.announce(S)
    twin.announce(2 * S)
    ((_, text),) = node.drain_texts()
    assert "impostor" in text
    assert "0x2877" in text


def test_what_the_captured_console_says_is_passed_on_as_it_stands():
    """The captured packets go to the peer's id; under that id they are ours."""
    node = make_node(part := Part())
    node.config = imc.NodeConfig(0x0803, "otter", uid=1)
    for name, raw in captured().items():
        if "Neptus" in name:
            node.receive(raw, Udp("10.77.0.1", 6001), 0)
    asked = {type(message) for message, _ in part.asked}
    assert {imc.Abort, imc.PlanDB, imc.PlanControl, imc.SetEntityParameters, imc.RemoteActions} <= asked

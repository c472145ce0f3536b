"""Go-tos and streams on a whole vessel: what is refused is not confirmed, and the operator hears why."""

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Station
from tests.world_station import GCS_HEARTBEAT, Helm

ACCEPTED, DENIED = 0, 14


def fenced(persona):
    """Armed, in Guided, 50 m of room."""
    helm = Helm(persona)
    x, y = helm.at(0, 0)
    assert helm.upload([(0, 5003, 50.0, 0, 0, 0, x, y, 0.0)], kind=1) == ACCEPTED
    assert helm.command(400, 1) == ACCEPTED
    assert helm.command(176, 1, 15) == ACCEPTED
    helm.gcs.clear()
    return helm


def go_to(helm, north_m, station=None):
    """The go-to that Mission Planner and QGroundControl send to ArduPilot."""
    x, y = helm.at(north_m, 0)
    item = dialect.MAVLink_mission_item_int_message(1, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, x, y, 0, 0)
    helm.link.write(0, (station or helm.gcs).codec.encode(item))
    helm.run(0.5)
    return [(ack.type, ack.target_system) for ack in helm.gcs.all("MISSION_ACK")]


def point(helm, north_m):
    x, y = helm.at(north_m, 0)
    return dialect.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, 0b111111111000, x, y, *[0] * 9)


def test_a_go_to_as_a_mission_item_is_confirmed_when_the_vessel_has_taken_it(persona):
    helm = fenced(persona)
    assert go_to(helm, 100.0) == [(DENIED, 255)]
    assert "outside the" in helm.texts()
    helm.gcs.clear()
    other = Station(250, 190)
    assert go_to(helm, 30.0, other) == [(ACCEPTED, 250)]

    def is_there() -> bool:
        helm.link.write(0, other.codec.encode(GCS_HEARTBEAT))  # who ordered commands: its silence would hold the boat
        return helm.truth.north_m > 10.0

    helm.until(is_there, 60.0)


def test_a_stream_out_of_the_fence_is_explained_now_and_then(persona):
    helm = fenced(persona)
    for _ in range(250):
        helm.link.write(0, helm.gcs.codec.encode(point(helm, 100.0)))
        helm.run(0.1)
    assert helm.texts().replace("\n", "").count("outside the fence") == 3
    assert abs(helm.truth.north_m) < 3.0


def test_who_does_not_have_the_sticks_hears_who_has(persona):
    helm = fenced(persona)
    assert helm.command(176, 1, 0) == ACCEPTED
    sticks = dialect.MAVLink_manual_control_message(1, 0, 0, 300, 0, 0)
    helm.gcs.clear()
    for _ in range(20):
        for station in (helm.gcs, Station(250, 190)):
            helm.link.write(0, station.codec.encode(sticks))
        helm.run(0.05)
    assert helm.world.snapshot.mode is Mode.MANUAL
    assert [text.split(" over ")[0] for text in helm.texts().splitlines() if "sticks" in text] == ["Station 255"]

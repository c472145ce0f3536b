"""Plans come back from the air bit for bit, whatever they hold, or are refused."""

import contextlib
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.mavlink.missions.wire import item_from_message, item_to_message
from mavlink_bridge.mavlink.wire.codec import Codec
from mavlink_bridge.radio.codec.plan import PlanCodecError, decode_plan, encode_plan

MISSIONS = Path(__file__).resolve().parents[3] / "shared" / "data" / "missions"
NEAR = (411_850_123, -87_062_154)

any_float = st.integers(0, 0xFFFF_FFFF).map(lambda raw: struct.unpack("<f", struct.pack("<I", raw))[0])
usual_float = st.sampled_from(
    [0.0, 1.0, -1.0, 1.5, 3.0, 20.0, 40.0, 600.0, 0.1, 2.25, float("nan"), -0.0, float("inf")]
)
reals = st.one_of(usual_float, any_float, st.floats(width=32))
int32 = st.integers(-(2**31), 2**31 - 1)
near_lat = st.integers(NEAR[0] - 200_000, NEAR[0] + 200_000)
near_lon = st.integers(NEAR[1] - 200_000, NEAR[1] + 200_000)
items = st.builds(
    PlanItem,
    command=st.one_of(st.sampled_from([16, 17, 18, 19, 20, 178, 93, 112, 177, 5001]), st.integers(0, 65535)),
    frame=st.one_of(st.sampled_from([3, 6, 2, 0]), st.integers(0, 255)),
    param1=reals,
    param2=reals,
    param3=reals,
    param4=reals,
    x=st.one_of(near_lat, st.just(0), int32),
    y=st.one_of(near_lon, st.just(0), int32),
    z=reals,
    autocontinue=st.sampled_from([1, 1, 1, 0, 7]),
)


def frames(plan):
    """The very MISSION_ITEM_INT frames that this plan is on a wire."""
    codec = Codec(255, 190)
    return [codec.encode(item_to_message(item, seq, 1, 1, PlanKind.MISSION)) for seq, item in enumerate(plan)]


def rebuilt(plan, sent_near, heard_near, kind=PlanKind.MISSION):
    data = encode_plan(kind, plan, sent_near)
    got_kind, got = decode_plan(data, heard_near)
    assert got_kind is kind
    return got, data


@settings(max_examples=120, deadline=None)
@given(st.lists(items, max_size=12), st.sampled_from(list(PlanKind)))
def test_every_plan_comes_back_as_the_same_frames(plan, kind):
    got, _ = rebuilt(plan, NEAR, NEAR, kind)
    assert frames(got) == frames(plan)


@settings(max_examples=100, deadline=None)
@given(st.lists(items, min_size=1, max_size=6), st.integers(-80_000, 80_000), st.integers(-80_000, 80_000))
def test_the_ends_need_not_agree_where_the_vessel_is(plan, north, east):
    got, _ = rebuilt(plan, NEAR, (NEAR[0] + north, NEAR[1] + east))
    assert frames(got) == frames(plan)


@settings(max_examples=80, deadline=None)
@given(st.lists(items, min_size=1, max_size=6), st.integers(-(10**9), 10**9))
def test_far_apart_it_is_refused_or_right_never_wrong(plan, away):
    data = encode_plan(PlanKind.MISSION, plan, NEAR)
    try:
        _, got = decode_plan(data, (NEAR[0] + away, NEAR[1] - away))
    except PlanCodecError:
        return
    assert frames(got) == frames(plan)


@settings(max_examples=120, deadline=None)
@given(st.binary(max_size=80))
def test_noise_never_raises_anything_else(data):
    with contextlib.suppress(PlanCodecError):
        decode_plan(data, NEAR)


@settings(max_examples=60, deadline=None)
@given(st.lists(items, min_size=1, max_size=5), st.data())
def test_a_flipped_bit_is_never_another_plan(plan, data):
    coded = bytearray(encode_plan(PlanKind.MISSION, plan, NEAR))
    place = data.draw(st.integers(0, len(coded) * 8 - 1))
    coded[place // 8] ^= 1 << place % 8
    try:
        _, got = decode_plan(bytes(coded), NEAR)
    except PlanCodecError:
        return
    assert frames(got) == frames(plan)


def test_a_loiter_is_short():
    plan = [
        PlanItem(178, 2, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
        PlanItem(19, 3, 600.0, 0.0, 40.0, 0.0, 411_812_345, -86_987_654, 0.0),
    ]
    assert len(rebuilt(plan, NEAR, NEAR)[1]) <= 17


def test_clearing_is_a_plan_too():
    got, data = rebuilt([], NEAR, None)
    assert got == ()
    assert len(data) == 3


def test_without_a_position_the_vessel_says_so():
    data = encode_plan(PlanKind.MISSION, [PlanItem(16, 3, 0, 0, 0, 0, NEAR[0], NEAR[1], 0.0)], NEAR)
    with pytest.raises(PlanCodecError, match="does not know where it is"):
        decode_plan(data, None)


def test_every_shared_mission_file_comes_back():
    if not MISSIONS.is_dir():
        pytest.skip("outside data is not there: ../shared/data/missions")
    from mavlink_bridge.plans.files import read_plan

    seen = 0
    for path in sorted(MISSIONS.iterdir()):
        if path.name == "README.md":
            continue
        try:
            plan = read_plan(path.read_bytes(), path.name)
        except ValueError:
            continue
        for kind in PlanKind:
            found = plan.items(kind)
            for near in (NEAR, None, (found[0].x, found[0].y) if found else None):
                got, _ = rebuilt(list(found), near, near, kind)
                assert frames(got) == frames(found), path.name
            seen += len(found)
    assert seen > 300


def test_items_survive_the_wire_first():
    item = item_from_message(
        item_to_message(PlanItem(16, 3, 1, 2, 3, float("nan"), *NEAR, 4.0), 0, 1, 1, PlanKind.MISSION)
    )
    got, _ = rebuilt([item], NEAR, NEAR)
    assert frames(got) == frames([item])

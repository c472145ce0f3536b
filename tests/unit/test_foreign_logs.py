"""Logs of other recorders, as a fit reads them: what is missing, out of order or in another unit is never taken for motion."""

import math
import re

import numpy as np
import pytest

from companion.cli import main
from companion.tuning.hull_arrays import STEP_S
from companion.tuning.plausible import disbelieved
from companion.tuning.voyages import Column, parse_columns, read_voyage
from companion.tuning.windows import cut

NAMES = ("time", "heading", "surge", "sway", "yaw_rate", "port", "starboard")
PLACES = {"lat": Column("lat"), "lon": Column("lon")}
EARTH_M = 6.371e6
COLUMNS = {name: Column(name) for name in NAMES}
PERIOD_S = 0.1


def rows_of(seconds):
    """A boat that weaves ahead, at a throttle that steps each ten seconds."""
    found = []
    for k in range(round(seconds / PERIOD_S)):
        t = PERIOD_S * k
        throttle = 0.4 + 0.1 * (int(t / 10.0) % 5)
        heading, rate = 2.0 * math.sin(0.1 * t), 0.2 * math.cos(0.1 * t)
        found.append({"time": t, "heading": heading, "surge": 2.0 * throttle, "sway": 0.0, "yaw_rate": rate})
        found[-1] |= {"port": throttle + rate, "starboard": throttle - rate}
    return placed(found)


def placed(rows):
    """Add where she is."""
    north = east = 0.0
    for row in rows:
        cosine, sine = math.cos(row["heading"]), math.sin(row["heading"])
        north += PERIOD_S * (cosine * row["surge"] - sine * row["sway"])
        east += PERIOD_S * (sine * row["surge"] + cosine * row["sway"])
        row |= {"lat": math.degrees(north / EARTH_M), "lon": math.degrees(east / EARTH_M)}
    return rows


def written(path, rows, **changed):
    """Write a table; ``changed`` gives a column's cells from their row's number and value."""
    names = (*NAMES, *PLACES)
    lines = [",".join(names)]
    for k, row in enumerate(rows):
        told = (changed[name](k, row[name]) if name in changed else row[name] for name in names)
        lines.append(",".join(x if isinstance(x, str) else f"{x:.9g}" for x in told))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("nothing", ["", "nan"])
def test_a_command_stands_until_the_next_one(tmp_path, nothing):
    """Half of the cells are empty where two sources are merged: each was a throttle of 0, and the boat came out twice as fast."""
    rows = rows_of(60.0)
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    (holed,) = read_voyage(written(tmp_path / "h.csv", rows, port=lambda k, x: nothing if k % 2 else f"{x:g}"), COLUMNS)
    assert np.abs(holed.port - whole.port).max() < 0.11
    assert np.median(np.abs(holed.port - whole.port)) < 0.002
    assert holed.port.min() > 0.1


def test_what_stands_in_a_row_without_a_heading_is_a_command_too(tmp_path):
    rows = rows_of(60.0)
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    turns = {
        "heading": lambda k, x: "" if k % 2 else f"{x:g}",
        "port": lambda k, x: f"{x:g}" if k % 2 else "",
    }
    (merged,) = read_voyage(written(tmp_path / "merged.csv", rows, **turns), COLUMNS)
    assert np.median(np.abs(merged.port - whole.port[round(2.0 * PERIOD_S / STEP_S) :][: len(merged.port)])) < 0.01


def test_before_the_first_command_nobody_knows_what_the_propellers_did(tmp_path):
    late = written(tmp_path / "late.csv", rows_of(60.0), port=lambda k, x: "" if k < 200 else f"{x:g}")
    (stretch,) = read_voyage(late, COLUMNS)
    assert stretch.start_s == pytest.approx(20.0)


def test_a_clock_that_begins_again_begins_another_stretch_and_is_told(tmp_path):
    """Two logs in one file: all of the second was read between the seconds of the first."""
    first, second, told = rows_of(60.0), rows_of(40.0), []
    two = written(tmp_path / "two.csv", [*first, *second])
    stretches = read_voyage(two, COLUMNS, told.append)
    assert [round(stretch.seconds) for stretch in stretches] == [60, 40]
    for stretch, rows in zip(stretches, (first, second), strict=True):
        (alone,) = read_voyage(written(tmp_path / "alone.csv", rows), COLUMNS)
        np.testing.assert_allclose(stretch.psi_rad, alone.psi_rad)
    windows = cut([*stretches, *read_voyage(written(tmp_path / "more.csv", rows_of(60.0)), COLUMNS)])
    assert not windows.follows[[0, round(60.0 // 16.0)]].any()
    assert told == ["time steps back once (first from 59.9 to 0 s): what comes after is taken as another record"]


def test_a_clock_that_is_set_back_by_seconds_is_a_cut(tmp_path):
    rows = rows_of(60.0)
    for row in rows[300:]:
        row["time"] -= 3.0
    (early, late) = read_voyage(written(tmp_path / "set.csv", rows), COLUMNS)
    assert (early.start_s, late.start_s) == (pytest.approx(0.0), pytest.approx(27.0))
    assert early.seconds + late.seconds == pytest.approx(60.0, abs=0.3)


def swapped(rows):
    """Two sources merged as they came: each 4 s a row stands one place too late."""
    for k in range(0, len(rows) - 1, 40):
        rows[k : k + 2] = rows[k : k + 2][::-1]
    return rows


def late_by(seconds):
    def late(rows):
        """Each 6 s a row comes so late, and would be the newest command for the rows behind it."""
        back = round(seconds / PERIOD_S)
        for k in reversed(range(30, len(rows) - back, 60)):
            rows.insert(k + back, rows.pop(k))
        return rows

    return late


@pytest.mark.parametrize(("disorder", "count"), [(swapped, 15), (late_by(0.3), 10), (late_by(0.8), 10)])
def test_rows_a_little_out_of_order_are_put_in_order(tmp_path, disorder, count):
    """A record of ten minutes was cut into a hundred, or held "no stretch of 5 s"."""
    told = []
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows_of(60.0)), COLUMNS)
    (stretch,) = read_voyage(written(tmp_path / "late.csv", disorder(rows_of(60.0))), COLUMNS, told.append)
    for name in ("port", "psi_rad", "surge", "rate"):
        np.testing.assert_array_equal(getattr(stretch, name), getattr(whole, name))
    assert told == [f"time steps back by less than 1 s {count} times: these rows are put in order"]


def test_a_second_log_with_late_rows_is_still_a_second_log(tmp_path):
    told = []
    rows = [*swapped(rows_of(60.0)), *swapped(rows_of(40.0))]
    stretches = read_voyage(written(tmp_path / "two.csv", rows), COLUMNS, told.append)
    assert [round(stretch.seconds) for stretch in stretches] == [60, 40]
    assert told[0].startswith("time steps back once (first from 59.9 to 0.1 s): ")
    assert told[1:] == ["time steps back by less than 1 s 25 times: these rows are put in order"]


def test_what_is_cut_is_told_to_whoever_fits(tmp_path, capsys):
    two = written(tmp_path / "two.csv", [*rows_of(20.0), *rows_of(20.0)])
    named = [f"{name}={name}" for name in NAMES]
    assert (
        main(["tune", "vessel", str(two), "--vessel", "otter", "--columns", *named, "-o", str(tmp_path / "o.toml")])
        == 1
    )
    assert "two.csv: time steps back once" in capsys.readouterr().out


def refused(file, columns=COLUMNS):
    with pytest.raises(ValueError, match=r"\w") as caught:
        read_voyage(file, columns)
    return str(caught.value)


def test_a_time_in_milliseconds_is_refused_with_the_scale_that_mends_it(tmp_path):
    """It was told that no stretch holds heading, commands and speed: all of them do."""
    rows = rows_of(60.0)
    file = written(tmp_path / "ms.csv", rows, time=lambda k, t: f"{1000.0 * t:g}")
    told = refused(file)
    assert "a row comes every 100 s" in told
    scale = told.rpartition("--columns ")[2]
    assert scale == "time=time,0,1000"
    assert read_voyage(file, COLUMNS | parse_columns([scale]))[0].seconds == pytest.approx(60.0, abs=0.2)


def test_rows_that_come_too_seldom_are_refused_by_their_period(tmp_path):
    told = refused(written(tmp_path / "slow.csv", rows_of(600.0)[::30]))
    assert "a row comes every 3 s; a fit needs one every" in told
    assert "ms" not in told


def test_a_row_a_second_is_read_and_its_limits_are_told(tmp_path):
    """It was refused as if it held neither heading nor speed."""
    rows, told = rows_of(120.0), []
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    (stretch,) = read_voyage(written(tmp_path / "slow.csv", rows[::10]), COLUMNS, told.append)
    assert stretch.seconds == pytest.approx(119.0)
    assert stretch.psi_rad == pytest.approx(whole.psi_rad[: len(stretch.psi_rad)], abs=0.01)
    assert told == ["a row comes every 1 s: what is quicker (lags, yaw inertia) is told roughly; five a second tell it"]
    lost = [row for k, row in enumerate(rows[::10]) if not 50 <= k < 53]
    assert len(read_voyage(written(tmp_path / "lost.csv", lost), COLUMNS)) == 2


def test_a_comma_behind_each_row_is_no_column(tmp_path):
    """It was a traceback: no row had as many cells as the header."""
    rows = rows_of(60.0)
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    head, *lines = (tmp_path / "whole.csv").read_text(encoding="utf-8").splitlines()
    (tmp_path / "comma.csv").write_text("\n".join([head, *(f"{line}," for line in lines)]) + "\n", encoding="utf-8")
    (stretch,) = read_voyage(tmp_path / "comma.csv", COLUMNS)
    np.testing.assert_array_equal(stretch.port, whole.port)


@pytest.mark.parametrize(("separator", "word"), [(";", "semicolons"), ("\t", "tabs")])
def test_another_separator_than_commas_is_named(tmp_path, separator, word):
    """It was told that all columns are missing."""
    file = written(tmp_path / "a.csv", rows_of(60.0))
    file.write_text(file.read_text(encoding="utf-8").replace(",", separator), encoding="utf-8")
    assert refused(file) == f"its columns are parted by {word}: write commas, and points in numbers"


def test_blanks_after_the_commas_of_a_header_belong_to_no_name(tmp_path):
    """It was refused, and the names that it was said to have were those that had been typed."""
    rows = rows_of(60.0)
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    head, *lines = (tmp_path / "whole.csv").read_text(encoding="utf-8").splitlines()
    head = head.replace(",", ", ").replace("surge", '"surge"')
    (tmp_path / "blanks.csv").write_text("\n".join([f"{head} ", *lines]) + "\n", encoding="utf-8")
    (stretch,) = read_voyage(tmp_path / "blanks.csv", COLUMNS)
    np.testing.assert_array_equal(stretch.surge, whole.surge)


def test_rows_of_another_length_are_told_and_all_of_them_refused(tmp_path):
    head, *lines = written(tmp_path / "a.csv", rows_of(60.0)).read_text(encoding="utf-8").splitlines()
    told = []
    (tmp_path / "torn.csv").write_text("\n".join([head, *lines, "1,2,3"]) + "\n", encoding="utf-8")
    assert len(read_voyage(tmp_path / "torn.csv", COLUMNS, told.append)) == 1
    assert told == ["rows left out for another number of cells than the header has: 1 of 601"]
    (tmp_path / "more.csv").write_text("\n".join([head, *(f"{line},7" for line in lines)]) + "\n", encoding="utf-8")
    assert refused(tmp_path / "more.csv") == "its header names 9 columns, and no row has so many (10 in the first)"


def spoilt(file, at, spoil):
    """A file whose card has lost some bytes, as many as ``spoil`` holds."""
    whole = file.read_bytes()
    file.write_bytes(whole[:at] + spoil + whole[at + len(spoil) :])
    return file


@pytest.mark.parametrize(
    "spoil", [b"\x80", b'"', b"\x00" * 40, bytes(range(128, 256)), b"\xff" * 200_000, b"\x00" * 200_000]
)
def test_bytes_that_a_card_has_lost_cost_their_rows_alone(tmp_path, spoil):
    """One of them made the whole voyage useless: "'utf-8' codec can't decode byte 0x80"."""
    rows, told = rows_of(1200.0), []
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    file = spoilt(written(tmp_path / "log.csv", rows), 20_000, spoil)
    left = read_voyage(file, COLUMNS, told.append)
    per_row = file.stat().st_size / len(rows)
    lost_s = PERIOD_S * (len(spoil) / per_row + 4.0)
    assert whole.seconds - lost_s < math.fsum(stretch.seconds for stretch in left) <= whole.seconds
    for stretch in left:
        assert np.nanmax(np.abs(stretch.surge)) <= whole.surge.max() + 1e-9
    assert len(told) >= 1


def test_a_byte_that_is_lost_in_another_column_costs_nothing(tmp_path):
    rows, told = rows_of(60.0), []
    for row in rows:
        row["lat"] = "somewhere"
    (whole,) = read_voyage(written(tmp_path / "log.csv", rows), COLUMNS, told.append)
    text = (tmp_path / "log.csv").read_bytes()
    (left,) = read_voyage(spoilt(tmp_path / "log.csv", text.index(b"somewhere", 2000), b"\x80"), COLUMNS, told.append)
    np.testing.assert_array_equal(left.psi_rad, whole.psi_rad)
    assert told == []


def test_a_file_of_another_encoding_is_named(tmp_path):
    file = written(tmp_path / "log.csv", rows_of(60.0))
    file.write_bytes(file.read_text(encoding="utf-8").encode("utf-16"))
    assert refused(file) == "its first line is no text in UTF-8: save it as CSV, UTF-8"


def test_an_empty_column_and_a_vessel_that_never_sailed_are_named(tmp_path):
    rows = rows_of(60.0)
    empty = written(tmp_path / "empty.csv", rows, sway=lambda k, x: "")
    assert refused(empty) == "column sway (sway) holds no number in any row"
    idle = written(tmp_path / "idle.csv", rows, sway=lambda k, x: 0)
    assert "sway (armed) is never 1" in refused(idle, COLUMNS | {"sway": Column("surge"), "armed": Column("sway")})
    assert "it lasts 3" in refused(written(tmp_path / "short.csv", rows[:32]))


def times(factor):
    return lambda k, x: factor * x


@pytest.mark.parametrize(
    ("changed", "found", "mend"),
    [
        ({"yaw_rate": times(-1.0)}, "heading turns -1 times as fast", "yaw_rate=yaw_rate,0,-1"),
        ({"yaw_rate": times(57.2958)}, "heading turns 0.0175 times as fast", "yaw_rate=yaw_rate,0,57.296"),
        ({"yaw_rate": times(0.5)}, "heading turns 2 times as fast", "yaw_rate=yaw_rate,0,0.5"),
        ({"heading": lambda k, x: math.degrees(x) % 360.0}, "times as fast", "heading=heading,0,57.296"),
        ({"heading": lambda k, x: 0.5 * math.pi - x}, "heading turns -1 times", "heading=heading,1.5708,-1"),
        (
            {"heading": times(57.2958), "yaw_rate": times(57.2958)},
            "in degrees",
            "heading=heading,0,57.296 yaw_rate=yaw_rate,0,57.296",
        ),
        (
            {"surge": times(3.6)},
            "surge (column surge) is 3.60 times what the places tell; is it in km/h",
            "surge=surge,0,3.6",
        ),
        ({"surge": times(1.944)}, "in knots", "surge=surge,0,1.944"),
        ({"surge": times(-1.0)}, "is its sign right", "surge=surge,0,-1"),
        ({"sway": times(-1.0)}, "sway (column sway) is -1.03 times what the places tell", "sway=sway,0,-1"),
    ],
)
def test_a_column_in_another_unit_or_sense_is_named_with_the_mend_that_mends_it(tmp_path, changed, found, mend):
    """Each was fitted and offered for adoption, or called rough water."""
    rows = rows_of(120.0)
    for row in rows:
        row["sway"] = -2.0 * row["yaw_rate"]
    file, columns = written(tmp_path / "log.csv", placed(rows), **changed), COLUMNS | PLACES
    told = disbelieved(read_voyage(file, columns), columns)
    assert found in told
    given = re.search(r"--columns ((?:\w+=[-\w.,]+ ?)+)", told)[1].split()
    assert given == mend.split()
    mended = columns | parse_columns(given)
    assert disbelieved(read_voyage(file, mended), mended) == ""


ALONG = {name: column for name, column in (COLUMNS | PLACES).items() if name != "sway"}
"""What most loggers tell: a speed and a place."""
NO_SPEED = {name: column for name, column in ALONG.items() if name != "surge"}


@pytest.mark.parametrize("factor", [1.944, 3.6, 100.0, -1.0])
@pytest.mark.parametrize("columns", [ALONG, COLUMNS | PLACES])
def test_a_speed_in_another_unit_is_seen_by_the_places_without_sway_too(tmp_path, factor, columns):
    """With places and a speed alone it was fitted: a top speed of 4.1 m/s for 2.1, and no word."""
    file = written(tmp_path / "log.csv", rows_of(120.0), surge=times(factor))
    told = disbelieved(read_voyage(file, columns), columns)
    assert f"--columns surge=surge,0,{factor:g}" in told
    sound = written(tmp_path / "sound.csv", rows_of(120.0))
    assert disbelieved(read_voyage(sound, columns), columns) == ""


def astern_and_ahead(seconds):
    """She backs off for a minute of each three."""
    rows = rows_of(seconds)
    for row in rows:
        if row["time"] % 180.0 > 120.0:
            row |= {"surge": -0.5 * row["surge"], "port": -row["starboard"], "starboard": -row["port"]}
    return placed(rows)


def test_a_speed_over_ground_that_is_taken_for_surge_is_told(tmp_path):
    """Way astern was way ahead to the fit."""
    rows = astern_and_ahead(360.0)
    file = written(tmp_path / "log.csv", rows, surge=lambda k, x: abs(x))
    told = disbelieved(read_voyage(file, ALONG), ALONG)
    assert "is it a speed over ground (SOG)? then leave surge out" in told
    assert disbelieved(read_voyage(file, NO_SPEED), NO_SPEED) == ""
    assert disbelieved(read_voyage(written(tmp_path / "sound.csv", rows), ALONG), ALONG) == ""


def moored_at(lat_deg, lon_deg, rows):
    """The same voyage elsewhere on the globe, in a steady current."""
    for row in rows:
        lat = lat_deg + row["lat"] + 0.3 * row["time"] / EARTH_M * 57.3
        row |= {"lat": lat, "lon": lon_deg + row["lon"] / math.cos(math.radians(lat_deg))}
    return rows


MIRRORS = {
    "swapped": {"lat": Column("lon"), "lon": Column("lat")},
    "no west": {"lon": Column("lon", 0.0, -1.0)},
    "no south": {"lat": Column("lat", 0.0, -1.0)},
}


@pytest.mark.parametrize("place", [(0.0, 9.0), (53.5, 10.0), (-41.2, 174.8), (70.0, -20.0)])
@pytest.mark.parametrize("mirror", MIRRORS.values(), ids=MIRRORS.keys())
@pytest.mark.parametrize("columns", [ALONG, NO_SPEED])
def test_places_in_a_mirror_are_told_with_the_mend_that_mends_them(tmp_path, place, mirror, columns):
    """Each passed every look, and the fit of it came to no end."""
    file, wrong = written(tmp_path / "log.csv", moored_at(*place, rows_of(300.0))), columns | mirror
    assert disbelieved(read_voyage(file, columns), columns) == ""
    if abs(place[1]) > 90.0 and "lat" in mirror and mirror["lat"].name == "lon":
        with pytest.raises(ValueError, match="are lat and lon changed over"):
            read_voyage(file, wrong)
        return
    told = disbelieved(read_voyage(file, wrong), wrong)
    assert "a track that turns to port where her bow turns to starboard" in told
    mended = wrong | parse_columns(re.search(r"--columns (.*)", told)[1].split())
    assert disbelieved(read_voyage(file, mended), mended) == ""


@pytest.mark.parametrize(
    ("written_as", "told"),
    [
        (lambda k, x: f"{round(1e7 * x)}", "lat=lat,0,1e7 if it is in 1e-7 degrees"),
        (lambda k, x: f"{100 * int(x) + x % 1 * 60:.5f}", "are these degrees and minutes (ddmm.mm)? then make degrees"),
    ],
)
def test_places_that_are_not_in_degrees_are_refused(tmp_path, written_as, told):
    file = written(tmp_path / "log.csv", moored_at(53.5, 10.0, rows_of(60.0)), lat=written_as, lon=written_as)
    assert told in refused(file, NO_SPEED)


def test_minutes_that_pass_for_degrees_are_seen_by_the_speed_that_they_make(tmp_path):
    """Near the equator and Greenwich ddmm.mm stays on the globe."""
    file = written(tmp_path / "log.csv", rows_of(60.0), lat=times(60.0), lon=times(60.0))
    told = disbelieved(read_voyage(file, ALONG), ALONG)
    assert "m/s: are they in degrees" in told


@pytest.mark.parametrize(
    ("changed", "mend"),
    [
        ({"surge": times(-1.0)}, "is the sign of surge right? --columns surge=surge,0,-1"),
        ({"port": times(-1.0), "starboard": times(-1.0)}, "--columns port=port,0,-1 starboard=starboard,0,-1"),
    ],
)
def test_a_boat_that_goes_astern_by_a_throttle_ahead_is_told_which_column_is_reversed(tmp_path, changed, mend):
    """Without places: which way she turns tells whether throttle or speed is the wrong way round."""
    stretches = read_voyage(written(tmp_path / "log.csv", rows_of(120.0), **changed), COLUMNS)
    told = disbelieved(stretches, COLUMNS)
    assert "she goes astern when the throttle pushes ahead (correlation -" in told
    assert mend in told
    assert told.count("--columns") == 1


def up_and_down_a_river(stream_mps=1.0):
    """Each way with another order over ground: against the stream she pushes more and is slower. A hull takes 3 s for its way."""
    rows, through, heading, integral = rows_of(600.0), 0.0, 0.0, 0.0
    for k, row in enumerate(rows):
        upstream = int(k * PERIOD_S / 75.0) % 2
        before = heading
        heading += max(-0.03, min(0.03, math.pi * upstream - heading))
        over_ground = through + stream_mps * math.cos(heading)
        error = (0.5 if upstream else 1.4) - over_ground
        integral = max(-0.5, min(0.5, integral + 0.1 * PERIOD_S * error))
        throttle = max(0.0, min(0.85, 0.2 * error + integral + 0.3))
        through += PERIOD_S / 3.0 * (2.0 * throttle - through)
        rate = (heading - before) / PERIOD_S
        row |= {"heading": heading, "yaw_rate": rate, "surge": over_ground, "sway": -stream_mps * math.sin(heading)}
        row |= {"port": throttle + 0.3 * rate, "starboard": throttle - 0.3 * rate}
    return rows


def test_a_stream_is_no_sign_that_is_wrong(tmp_path):
    """A sound record of a river was refused, and the mend that was offered made it a wrong one that passed."""
    rows = up_and_down_a_river()
    push, over_ground = ([row[name] for row in rows] for name in ("port", "surge"))
    assert np.corrcoef(push, over_ground)[0, 1] < -0.5
    file = written(tmp_path / "river.csv", rows)
    assert disbelieved(read_voyage(file, COLUMNS), COLUMNS) == ""
    assert disbelieved(read_voyage(file, COLUMNS)) == ""
    wrong = COLUMNS | parse_columns(["surge=surge,0,-1"])
    assert "surge=surge,0,-1" not in disbelieved(read_voyage(file, wrong), wrong)
    assert "she goes astern" in disbelieved(read_voyage(file, wrong), wrong)


def test_thrusters_that_are_swapped_are_told(tmp_path):
    """It was called rough water: the owner sailed again for nothing."""
    swapped = COLUMNS | {"port": Column("starboard"), "starboard": Column("port")}
    file = written(tmp_path / "log.csv", rows_of(120.0))
    told = disbelieved(read_voyage(file, swapped), swapped)
    assert "she turns to port where port and starboard should turn her to starboard (correlation -" in told
    assert "are they swapped? then --columns port=port,0,1 starboard=starboard,0,1" in told
    assert disbelieved(read_voyage(file, COLUMNS), COLUMNS) == ""


def test_a_rudder_of_the_wrong_sense_is_told(tmp_path):
    file = written(
        tmp_path / "log.csv", rows_of(120.0), starboard=lambda k, x: -2.0 * 0.2 * math.cos(0.1 * k * PERIOD_S)
    )
    columns = {name: column for name, column in COLUMNS.items() if name != "starboard"} | {
        "rudder": Column("starboard")
    }
    assert "is its sign right? --columns rudder=starboard,0,-1" in disbelieved(read_voyage(file, columns), columns)


@pytest.mark.parametrize(
    ("sides", "said", "mend"),
    [
        (times(100.0), "to 84.9, and is -1 to 1", "port=port,0,100 if it is in percent"),
        (lambda k, x: 1500.0 + 400.0 * x, "to 1840, and is -1 to 1", "port=port,1500,400 if it is in us"),
        (times(3.0), "to 2.547, and is -1 to 1", "port=port,ZERO,SCALE"),
    ],
)
def test_a_throttle_in_another_unit_is_refused_and_not_cut_off(tmp_path, sides, said, mend):
    file = written(tmp_path / "log.csv", rows_of(60.0), port=sides, starboard=sides)
    told = refused(file)
    assert said in told
    assert told.endswith(f"--columns {mend}")


def test_a_rudder_in_degrees_is_refused(tmp_path):
    file = written(tmp_path / "log.csv", rows_of(60.0), sway=lambda k, x: 25.0 * math.sin(0.1 * k))
    columns = COLUMNS | PLACES | {"rudder": Column("sway")}
    del columns["sway"]
    assert "rudder=sway,0,57.296 if it is in degrees" in refused(file, columns)


def test_a_few_spikes_are_left_out_and_told(tmp_path):
    rows, told = rows_of(60.0), []
    (whole,) = read_voyage(written(tmp_path / "whole.csv", rows), COLUMNS)
    spiky = written(tmp_path / "spiky.csv", rows, port=lambda k, x: 65535.0 if k in (100, 300) else x)
    (stretch,) = read_voyage(spiky, COLUMNS, told.append)
    assert np.abs(stretch.port - whole.port).max() < 0.11
    assert told == ["port (column port): 2 values beyond -1 to 1 are left out"]


def test_headings_of_another_boat_are_not_taken(tmp_path):
    strange = written(tmp_path / "log.csv", rows_of(120.0), heading=lambda k, x: math.sin(0.37 * k * PERIOD_S))
    assert "do not tell of the same turns" in disbelieved(read_voyage(strange, COLUMNS), COLUMNS)


def hardly_turning():
    """A boat that holds her course for ten minutes, but for one minute of weaving."""
    rows = rows_of(600.0)
    for row in rows:
        t = row["time"]
        weaves = 0.8 if 200.0 < t < 260.0 else 0.0
        row["heading"] = 4.0 + 0.25 * math.sin(0.05 * t) + weaves * math.sin(0.3 * (t - 200.0))
        row["yaw_rate"] = 0.0125 * math.cos(0.05 * t) + 0.3 * weaves * math.cos(0.3 * (t - 200.0))
        row |= {"port": 0.4 + row["yaw_rate"], "starboard": 0.4 - row["yaw_rate"]}
    return rows


def each(count, value, factor=1.0):
    return lambda k, x: value if k % count == count // 2 else factor * x


@pytest.mark.parametrize(
    "changed",
    [
        {"heading": each(100, 0.0)},
        {"heading": each(30, 0.0)},
        {"yaw_rate": each(200, 20.0)},
        {"yaw_rate": each(30, 20.0)},
        {"yaw_rate": lambda k, x: x + 0.09},
    ],
)
@pytest.mark.parametrize("voyage", [hardly_turning, lambda: rows_of(300.0)])
def test_spikes_and_a_bias_are_no_other_column_and_no_other_scale(tmp_path, voyage, changed):
    """A compass that says 0 in one row of a hundred: "is the scale of yaw_rate right?", with a mend that halved it and passed."""
    assert disbelieved(read_voyage(written(tmp_path / "log.csv", voyage(), **changed), COLUMNS), COLUMNS) == ""


@pytest.mark.parametrize("wrong", [2.0, 0.5, 57.2958, -1.0])
@pytest.mark.parametrize("voyage", [hardly_turning, lambda: rows_of(300.0)])
def test_a_scale_that_is_wrong_is_told_among_spikes_too(tmp_path, voyage, wrong):
    changed = {"heading": each(100, 0.0), "yaw_rate": each(200, 20.0, wrong)}
    told = disbelieved(read_voyage(written(tmp_path / "log.csv", voyage(), **changed), COLUMNS), COLUMNS)
    (scale,) = re.findall(r"yaw_rate=yaw_rate,0,([-\d.]+)", told)
    assert float(scale) == pytest.approx(wrong, rel=0.02)


@pytest.mark.parametrize("dead", [{"heading": times(0.0)}, {"yaw_rate": times(0.0)}])
def test_a_sensor_that_stands_still_is_told(tmp_path, dead):
    file = written(tmp_path / "log.csv", hardly_turning(), **dead)
    assert "do not tell of the same turns" in disbelieved(read_voyage(file, COLUMNS), COLUMNS)


def test_a_run_of_ones_own_is_sent_to_its_sensors(tmp_path):
    stretches = read_voyage(written(tmp_path / "log.csv", rows_of(120.0), yaw_rate=times(-1.0)), COLUMNS)
    told = disbelieved(stretches)
    assert "look at sensors, leads and channels" in told
    assert "--columns" not in told


def test_a_log_that_is_not_believed_is_not_fitted(tmp_path, capsys):
    file = written(tmp_path / "log.csv", rows_of(120.0), yaw_rate=times(-1.0))
    named = [f"{name}={name}" for name in NAMES]
    assert (
        main(["tune", "vessel", str(file), "--vessel", "otter", "--columns", *named, "-o", str(tmp_path / "o.toml")])
        == 2
    )
    assert "then --columns yaw_rate=yaw_rate,0,-1" in capsys.readouterr().err
    assert not (tmp_path / "o.toml").exists()

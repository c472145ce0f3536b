"""A report in a browser, on a phone and on a desk: nothing overflows, everything is legible, one time is pointed at and zoomed for all."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import subprocess

import pytest

import config as shipped
from companion.report.embed import differences
from companion.report.flight import Flight, FlightTrack
from companion.report.from_run import read_run
from companion.report.map_data import map_data
from companion.report.page import make_page
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World

PLAN = (PlanItem(18, 6, 1, 0, 12.0, 0, 411854500, -87057000, 0),)
ROWS, COLUMNS, LAT, LON = 60, 60, 41.1835, -8.7080

MEASURE = """
const page = frame.contentDocument, seen = frame.contentWindow, out = {};
const all = (what) => [...page.querySelectorAll(what)];
const scrolled = (item) => item.closest(".events, .wide-table, pre, details") || item.tagName === "image";
const rows = (box) => all(box).map((item) => item.getBoundingClientRect());
out.wide = page.documentElement.scrollWidth;
const beyond = (item) => item.getBoundingClientRect().right > seen.innerWidth + 1;
out.over = all("body *").filter((item) => !scrolled(item) && beyond(item)).map((item) => item.tagName);
out.least_px = Math.min(...all("text, td, p, span, output, button").map((item) => parseFloat(seen.getComputedStyle(item).fontSize)));
out.buttons_px = Math.min(...rows("button").map((box) => Math.min(box.width, box.height)));
out.unnamed = all("svg[role=img], input, button").filter((item) => !(item.getAttribute("aria-label") || item.textContent)).length;
out.map = all(".map text").map((item) => item.textContent);
out.chart = all(".map image").length;
out.legends = all(".legend").map((item) => item.textContent);
const told = () => page.querySelector("#time output").textContent;
const axis = () => all(".panel")[0].querySelectorAll("text[text-anchor=middle]:not(.state)")[1].textContent;
const box = all(".panel svg")[1], where = box.getBoundingClientRect(), middle = where.left + where.width * 0.6;
const mouse = { clientY: where.top + 40, pointerId: 1, pointerType: "mouse", bubbles: true };
const send = (kind, x) => all(".panel svg")[1].dispatchEvent(new seen.PointerEvent(kind, { clientX: x, ...mouse }));
all(".panel svg").forEach((one) => { one.setPointerCapture = () => {}; });
out.at_start = told();
send("pointermove", middle);
out.pointed = told();
out.cursors = all(".panel .cursor").map((line) => line.getAttribute("visibility"));
out.lines = [...new Set(all(".panel .cursor").map((line) => Math.round(Number(line.getAttribute("x1")))))].length;
const boat = page.querySelector(".boat");
out.boat = [boat.getAttribute("visibility"), boat.getAttribute("cx"), boat.getAttribute("cy")];
out.axis = axis();
send("pointerdown", where.left + where.width * 0.5);
send("pointermove", where.left + where.width * 0.7);
send("pointerup", where.left + where.width * 0.7);
out.zoomed = axis();
page.querySelector("[data-do=whole]").click();
out.whole = axis();
page.querySelector("[data-do=in]").click();
out.closer = axis();
page.querySelector("[data-do=whole]").click();
const slider = page.querySelector("#time input");
slider.value = 5;
slider.dispatchEvent(new seen.Event("input"));
out.by_key = [told(), slider.getAttribute("aria-valuetext")];
const scale = () => all(".map .scale-text")[0].textContent;
out.scale = scale();
all(".tools button")[0].click();
all(".tools button")[0].click();
out.near = scale();
"""


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A loiter of a minute over the owner's chart: deep in the west, shallow and dry in the east."""
    folder = tmp_path_factory.mktemp("report")
    places = ((LAT + row * 6e-5, LON + column * 8e-5) for row in range(ROWS) for column in range(COLUMNS))
    lines = [f"{lon:.7f} {lat:.7f} {(-8.7052 - lon) * 40000.0:.2f}\n" for lat, lon in places]
    (folder / "harbour.xyz").write_text("".join(lines))
    changes = ("operator.gcs_required=false", f'depth.map.file="{folder}/harbour.xyz"')
    settings = load(shipped.path("sim.toml"), changes, SimSettings)
    run_dir = folder / "loiter"
    world = World(settings, 5, run_dir=run_dir, about={"seed": 5, "settings": settings.model_dump(mode="json")})
    plan = load_plan(PlanKind.MISSION, PLAN)
    assert isinstance(plan, LoadPlan)
    world.app.submit(plan)
    world.run(3.0)
    world.app.submit(Arm(True))
    world.app.submit(StartPlan())
    world.run(57.0)
    world.shutdown(world.now_us)
    return read_run(run_dir)


@pytest.fixture(scope="module")
def chromium():
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        if os.environ.get("REQUIRE_ALL") == "1":
            pytest.fail("chromium is missing, and REQUIRE_ALL=1 makes that a failure", pytrace=False)
        pytest.skip("chromium is missing")
    return found


def measured(chromium, folder, page, width):
    """What a person at a window so wide meets: the page in a frame, pointed at and pressed."""
    (folder / "page.html").write_text(page, encoding="utf-8")
    told = 'document.querySelector("pre").textContent = JSON.stringify(out);'
    script = f'const frame = document.querySelector("iframe"); frame.onload = () => {{ {MEASURE} {told} }};'
    frame = f'<iframe style="width:{width}px;height:900px;border:0"></iframe>'
    outer = f'<pre></pre>{frame}<script>{script} frame.src = "page.html";</script>'
    (folder / "outer.html").write_text(outer, encoding="utf-8")
    words = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--allow-file-access-from-files",
        "--virtual-time-budget=4000",
    ]
    words += [f"--user-data-dir={folder}/profile", f"--window-size={width + 40},1000", "--dump-dom"]
    shown = subprocess.run(
        [chromium, *words, (folder / "outer.html").as_uri()], capture_output=True, text=True, timeout=180, check=True
    ).stdout
    found = re.search(r"<pre>(.*?)</pre>", shown, re.DOTALL)
    assert found is not None
    assert found[1], "the page's script did not run to its end"
    return json.loads(html.unescape(found[1]))


@pytest.mark.parametrize("width", [390, 1280])
def test_it_is_read_pointed_at_and_zoomed(flight, chromium, tmp_path, width):
    seen = measured(chromium, tmp_path, make_page(flight), width)
    assert seen["wide"] <= width
    assert seen["over"] == []
    assert seen["least_px"] >= 12.0
    assert seen["buttons_px"] >= 40.0, "as large as a thumb"
    assert seen["unnamed"] == 0
    assert "N" in seen["map"]
    assert any(re.fullmatch(r"[125]0* m", text) for text in seen["map"]), "a scale bar of a round length"
    assert seen["chart"] == 1
    assert any("harbour.xyz" in text for text in seen["legends"])
    assert seen["at_start"].startswith("00:00.0")
    at_s = float(seen["pointed"].split()[0].split(":")[1])
    assert 20.0 < at_s < 50.0
    assert "Auto" in seen["pointed"]
    assert set(seen["cursors"]) == {"visible"}
    assert seen["lines"] == 1, "all charts point at one time"
    assert seen["boat"][0] == "visible"
    assert seen["whole"] == seen["axis"] != seen["zoomed"]
    assert seen["closer"] != seen["whole"]
    assert seen["by_key"][0].startswith("00:05.0")
    assert seen["by_key"][0] == seen["by_key"][1]
    assert float(seen["near"].split()[0]) < float(seen["scale"].split()[0])


def test_the_chart_under_the_track_is_the_owners(flight):
    """Tints from the north-west: deeper in the west, land in the east, unknown beyond the chart."""
    chart = map_data(flight)["chart"]
    row = next(row for row in chart["rows"] if row.strip("-"))
    known = [int(tint) for tint in row if tint != "-"]
    assert known == sorted(known, reverse=True)
    assert known[0] > known[-1]
    assert 0 in {int(tint) for row in chart["rows"] for tint in row if tint != "-"}
    assert chart["name"] == "harbour.xyz"


def test_a_chart_that_is_gone_is_a_note():
    flight = Flight("x", "file", 10.0)
    flight.tracks["estimate"] = FlightTrack([0.0, 1.0], [41.0, 41.001], [-8.0, -8.0])
    flight.settings = {"depth": {"map": {"file": "nowhere/harbour.xyz"}}}
    text = make_page(flight)
    assert "the chart is not shown" in text
    assert "harbour.xyz" in text


def test_no_verdict_is_called_like_a_mode(flight):
    cells = re.findall(r"<td class=(?:pass|fail)>(\w[\w ]*)", make_page(flight))
    assert cells
    assert set(cells) <= {"ok", "not ok"}


def test_what_is_not_known_stays_a_gap():
    assert differences([5, None, 7, 4]) == [5, None, 2, -3]

"""``companion plan`` against the simulator through real MAVSDK, for both personas."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from mavlink_bridge.language.requests import PlanItem
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.plans.files import PlanFile, read_plan, write_plan
from tests.e2e.sim import BIN, LAT_DEG, LON_DEG, Sim

X, Y = round(LAT_DEG * 1e7), round(LON_DEG * 1e7)
PLAN = PlanFile(
    (
        PlanItem(178, 2, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
        PlanItem(19, 3, 60.0, 0.0, 20.0, 1.0, X, Y, 0.0),
        PlanItem(16, 3, 0.0, 0.0, 0.0, float("nan"), X + 2_000, Y, 0.0),
        PlanItem(177, 2, 1.0, 2.0, 0.0, 0.0, 0, 0, 0.0),
    ),
    (PlanItem(5003, 0, 2_000.0, 0.0, 0.0, 0.0, X, Y, 0.0),),
    (PlanItem(5100, 3, 0.0, 0.0, 0.0, 0.0, X, Y + 1_000, 0.0),),
    None,
)


def plan(*words: object, limit_s: float = 60.0) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [BIN / "companion", "plan", *map(str, words)], capture_output=True, text=True, timeout=limit_s, check=False
    )


@pytest.mark.e2e
@pytest.mark.parametrize(("port", "instance"), [(14540, 45), (14550, 46)], ids=["generic", "ardurover"])
def test_a_plan_goes_up_comes_back_equal_sails_pauses_and_is_cleared(tmp_path: Path, port: int, instance: int) -> None:
    pytest.importorskip("mavsdk")
    given, back = tmp_path / "given.plan", tmp_path / "back.plan"
    given.write_text(write_plan(PLAN))
    bad = tmp_path / "bad.txt"
    bad.write_text("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t41\t-8\t0\t1\n1\t0\t3\t22\t0\t0\t0\t0\t41\t-8\t0\t1\n")
    with Sim(tmp_path / "run", instance=instance, speed=1.0) as sim:
        url = ("--url", f"udpin://0.0.0.0:{sim.port(port)}")
        up = plan("upload", given, *url)
        assert up.returncode == 0, up.stdout + up.stderr
        assert "mission: 4 items uploaded" in up.stdout
        down = plan("download", back, *url)
        assert down.returncode == 0, down.stdout + down.stderr
        boat = tmp_path / "boat.toml"
        boat.write_text(
            f'[[endpoints]]\nname = "none"\nurl = "tcp-listen://127.0.0.1:{sim.port(5769)}"\n'
            f'[[endpoints]]\nname = "tcp"\nurl = "tcp-listen://0.0.0.0:{sim.port(5760)}"\n'
        )
        again = plan("download", tmp_path / "again.plan", "--config", boat)
        assert again.returncode == 0, again.stderr
        assert f"found at tcpout://127.0.0.1:{sim.port(5760)}" in again.stderr
        found = read_plan(back.read_bytes())
        for kind in ("mission", "fence", "rally"):
            assert plan_id(getattr(found, kind)) == plan_id(getattr(PLAN, kind)), kind
        refused = plan("upload", bad, *url)
        assert refused.returncode == 1
        assert "NAV_TAKEOFF" in refused.stderr
        for words in (["start"], ["pause"], ["start", "--no-arm"], ["clear"]):
            done = plan(*words, *url)
            assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
        far = tmp_path / "far.plan"
        assert plan("make", far, "52.0,4.0").returncode == 0
        held = plan("upload", far, "--start", *url)
        assert held.returncode == 1
        assert "PLAN_FAR_OK=" in held.stderr
        meant = plan("start", "--far", *url)
        assert meant.returncode == 0, meant.stdout + meant.stderr
        assert plan("clear", *url).returncode == 0
        empty = plan("download", back, *url)
        assert empty.returncode == 0, empty.stderr
        assert read_plan(back.read_bytes()).mission == ()


@pytest.mark.e2e
def test_the_seeds_json_goes_through_the_radio_port_and_is_answered(tmp_path: Path) -> None:
    seed = tmp_path / "loiter.json"
    made = plan("make", seed, f"{LAT_DEG},{LON_DEG}", "--radius", 20, "--duration", 60, "--speed", 1.5)
    assert made.returncode == 0, made.stderr
    words = ("--set", "radio.protocol=json", "--set", "operator.gcs_required=false")
    with Sim(tmp_path / "run", instance=93, speed=1.0, arguments=words) as sim:
        sent = plan("send-json", seed, sim.run_dir / "lora", "--wait", 40)
    assert sent.returncode == 0, sent.stdout + sent.stderr
    assert '"result":"accepted"' in sent.stdout

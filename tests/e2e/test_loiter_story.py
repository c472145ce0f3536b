"""The story of the README with each ground station: upload a loiter, arm, start, watch it sailed within 1 m RMS."""

from __future__ import annotations

from pathlib import Path

from tests.e2e.sim import LAT_DEG, LON_DEG, Sim, circle_rms_m, client

LOITER_S = 100.0
RADIUS_M = 20.0
BAR_RMS_M = 1.0
NO_GCS = ("--set", "operator.gcs_required=false")
"""In accelerated time a ground station's heartbeats are rare; that the vessel misses them is tested elsewhere."""


RADIO_LOITER_S = 32.0
RADIO_RADIUS_M = 10.0
"""In real time: two thirds of a small lap are enough to see it sailed."""


def assert_circled(run_dir: Path, radius_m: float = RADIUS_M, laps_at_least: float = 0.9) -> None:
    rms_m, worst_m, laps = circle_rms_m(run_dir, LAT_DEG, LON_DEG, radius_m)
    print(f"radius error against truth: {rms_m:.3f} m RMS, {worst_m:.3f} m at most, {laps:.2f} laps")
    assert rms_m < BAR_RMS_M
    assert laps > laps_at_least


def steps(lines: list[dict[str, object]]) -> list[object]:
    return [line["step"] for line in lines]


def test_mavsdk_over_udp(tmp_path: Path) -> None:
    with Sim(tmp_path / "run", 11, arguments=NO_GCS) as sim:
        lines = client(
            "mavsdk_loiter.py", f"udpin://0.0.0.0:{sim.port(14540)}", str(LAT_DEG), str(LON_DEG), str(LOITER_S)
        )
    assert {"uploaded", "downloaded", "armed", "started", "done"} <= set(steps(lines))
    downloaded = next(line for line in lines if line["step"] == "downloaded")["items"]
    assert downloaded == [[178, 1.0, -1.0, 0, 0], [19, LOITER_S, RADIUS_M, round(LAT_DEG * 1e7), round(LON_DEG * 1e7)]]
    assert_circled(sim.run_dir)


def test_mavproxy_over_tcp(tmp_path: Path) -> None:
    folder = tmp_path / "mavproxy"
    folder.mkdir()
    with Sim(tmp_path / "run", 12, arguments=NO_GCS) as sim:
        lines = client(
            "mavproxy_loiter.py",
            f"tcp:127.0.0.1:{sim.port(5760)}",
            str(LAT_DEG),
            str(LON_DEG),
            str(LOITER_S),
            str(folder),
        )
    assert "done" in steps(lines)
    assert_circled(sim.run_dir)


def test_mavsdk_through_the_radio(tmp_path: Path) -> None:
    """MAVSDK opens the shore modem's serial port; the air carries 5.5 kbit/s, in real time.

    Its timers are real: on a machine so busy that simulated time lags, half a second is less air, and the client presses again, as an
    operator would. That it works at each phase of the timers and with losses is shown in virtual time (tests/scenario/test_radio_plain.py).
    """
    with Sim(tmp_path / "run", 13, speed=1.0) as sim:
        lines = client(
            "mavsdk_loiter.py",
            f"serial://{sim.run_dir}/lora:9600",
            str(LAT_DEG),
            str(LON_DEG),
            str(RADIO_LOITER_S),
            "ardurover",
            f"--radius-m={RADIO_RADIUS_M}",
            limit_s=150.0,
        )
    assert {"uploaded", "armed", "started", "done"} <= set(steps(lines))
    assert_circled(sim.run_dir, RADIO_RADIUS_M, laps_at_least=0.6)


def test_the_qgc_like_client_over_udp(tmp_path: Path) -> None:
    with Sim(tmp_path / "run", 17, arguments=NO_GCS) as sim:
        words = [str(sim.port(14550)), str(LAT_DEG), str(LON_DEG), str(LOITER_S), "200"]
        lines = client("qgc_loiter.py", *words)
    assert [step for step in steps(lines) if step != "retry"] == [
        "connected",
        "uploaded",
        "mode",
        "armed",
        "started",
        "done",
    ]
    assert lines[0]["failures"] == []
    assert_circled(sim.run_dir)

"""Sail a loiter in the simulator from Python: .venv/bin/python docs/examples/first_loiter.py"""

import companion
import sitl


def main(duration_s: float = 150.0, seed: int = 1) -> float:
    """Sail for a while; return the RMS radius error against truth, in metres."""
    circle = companion.loiter(41.18537, -8.70604, radius_m=20.0, duration_s=600.0, speed_mps=1.5)
    voyage = sitl.simulate(companion.plan_of([circle]), duration_s=duration_s, seed=seed)
    error = voyage.items[-1]["truth"]
    print(f"sailed {voyage.distance_m:.0f} m; radius error {error['rms_m']:.3f} m RMS, {error['max_m']:.2f} m at most")
    return float(error["rms_m"])


if __name__ == "__main__":
    main()

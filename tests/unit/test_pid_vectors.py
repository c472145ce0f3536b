"""DUNE's DiscretePID, by the vectors of the reference."""

import pytest

from companion.core.steer.pid import DiscretePid, PidGains

VECTORS = [
    (PidGains(kp=1.0, ki=0.5, kd=0.1), 0.0, 0.1, [0.5, 0.4, 0.3, 0.2, 0.1], [1.0, 0.325, 0.245, 0.16, 0.07]),
    (PidGains(kp=1.9, kd=0.85), 1.0, 0.1, [1.5708, 1.5, 1.4], [1.0, 1.0, 1.0]),
    (PidGains(kp=0.0, ki=1.0, integral_limit=2.0), 0.0, 1.0, [1, 1, 1, 1, -1], [0, 1, 2, 2, 2]),
]


@pytest.mark.parametrize(("gains", "limit", "dt", "errors", "outputs"), VECTORS)
def test_vector(gains, limit, dt, errors, outputs):
    pid = DiscretePid(gains, limit)
    assert [pid.step(dt, error).output for error in errors] == pytest.approx(outputs)


def test_reset_forgets_integral_and_error():
    pid = DiscretePid(PidGains(kp=1.0, ki=1.0, kd=1.0))
    first = pid.step(0.1, 1.0)
    pid.step(0.1, 1.0)
    pid.reset()
    assert pid.step(0.1, 1.0) == first


def test_changed_gains_reset_and_same_gains_do_not():
    pid = DiscretePid(PidGains(kp=0.0, ki=1.0))
    pid.step(1.0, 1.0)
    pid.configure(PidGains(kp=0.0, ki=1.0), 0.0)
    assert pid.step(1.0, 1.0).i == 1.0
    pid.configure(PidGains(kp=0.0, ki=2.0), 0.0)
    assert pid.step(1.0, 1.0).i == 0.0

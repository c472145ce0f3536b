"""Strangers' IMC packets break no promise of the bridge; ``make soak`` plays a million."""

from __future__ import annotations

import pytest

from tools.fuzzing.imc import GROWTH_LIMIT_KB, fuzz_imc


@pytest.mark.parametrize("read_only", [True, False])
def test_hostile_packets_break_no_promise(read_only):
    outcome = fuzz_imc(4_000, seed=5, read_only=read_only)
    assert not outcome.broken
    assert outcome.understood > 1_000
    assert outcome.answered > 500


@pytest.mark.soak
@pytest.mark.parametrize("read_only", [True, False])
def test_a_million_hostile_packets_and_less_than_5_mb_of_growth(read_only):
    outcome = fuzz_imc(1_000_000, seed=1, read_only=read_only)
    assert not outcome.broken
    assert outcome.growth_kb < GROWTH_LIMIT_KB

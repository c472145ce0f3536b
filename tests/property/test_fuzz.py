"""The fuzz harness in short; ``make fuzz`` and the soak run do a million frames."""

from __future__ import annotations

import pytest

from tools.fuzz import CORPUS, fuzz
from tools.fuzzing.decoders import fuzz_decoders
from tools.fuzzing.targets import targets

GUIDED = CORPUS / "guided"


def test_hostile_frames_break_no_promise_of_the_vessel(tmp_path):
    outcome = fuzz(12_000, seed=3, corpus=CORPUS, keep=False)
    assert not outcome.broken
    assert outcome.frames >= 12_000
    assert outcome.armed_ticks > 0
    assert outcome.sent_bytes > 100_000


def test_every_other_decoder_refuses_what_is_wrong_and_raises_nothing_else():
    assert fuzz_decoders(400, seed=3) == []


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.name)
def test_what_coverage_guided_fuzzing_has_kept_breaks_nothing(target):
    """The corpus of ``tools.fuzz_guided``: inputs that once broke something, and those that reach the most."""
    kept = [path.read_bytes() for path in sorted((GUIDED / target.name).glob("*"))]
    assert [*target.seeds, *kept]
    for blob in (*target.seeds, *kept):
        target.play(blob)


@pytest.mark.soak
def test_a_million_frames_and_less_than_5_mb_of_growth():
    outcome = fuzz(1_000_000, seed=1, corpus=CORPUS, keep=False)
    assert outcome.holds, outcome

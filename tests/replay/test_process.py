"""Process replay: recorded inputs through today's program, against the text of what it did when they were recorded.

After a wanted change of behaviour: ``pytest tests/replay --update-expected``, read the diff, and commit it with the change.
"""

from __future__ import annotations

import difflib

import pytest

from tests.replay import process


@pytest.mark.parametrize("name", process.names())
def test_the_program_does_what_it_did(name, tmp_path, request):
    found, _ = process.run(name, tmp_path)
    path = process.RECORDINGS / f"{name}.txt"
    if request.config.getoption("--update-expected"):
        path.write_text(found)
        return
    expected = path.read_text()
    if found != expected:
        diff = list(difflib.unified_diff(expected.splitlines(), found.splitlines(), "expected", "found", "", "", 0))
        shown = "\n".join(diff[:60])
        pytest.fail(f"{name}: {len(diff)} lines differ (--update-expected accepts)\n{shown}", pytrace=False)


def test_there_are_recordings():
    assert len(process.names()) >= 3

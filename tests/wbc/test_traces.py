"""Programs that calculate, branch and are interrupted, event by event: golden/traces.txt.

The rules behind it have their own tests; here whole sequences are compared, so that no step of a program changes unnoticed.
Regenerate with ``PYTHONPATH=tests/support python tests/wbc/test_traces.py`` and read the diff.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from golden_trace import Case, cases, regenerate

GOLDEN = Path(__file__).parent / "golden" / "traces.txt"


@pytest.mark.parametrize("case", cases(GOLDEN), ids=lambda case: case.name)
def test_traces_are_the_reviewed_ones(case: Case) -> None:
    assert case.trace().splitlines() == case.expected.splitlines()


@pytest.mark.parametrize("case", cases(GOLDEN), ids=lambda case: case.name)
def test_advancing_in_one_go_gives_the_same(case: Case) -> None:
    """Rule 2 of the time contract."""
    edges, events, seen = case.ends(in_one_go=False)
    assert case.ends(in_one_go=True) == (edges, events, seen)


if __name__ == "__main__":
    regenerate(GOLDEN)

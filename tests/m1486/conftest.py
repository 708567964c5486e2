"""Programs to test with: random ones that the language permits, and the manual's own."""

from __future__ import annotations

from pathlib import Path

import m1486_programs
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples" / "m1486"


@pytest.fixture(scope="session")
def permitted_programs() -> m1486_programs.Programs:
    return m1486_programs.permitted_programs


@pytest.fixture(scope="session")
def manual_examples() -> dict[int, str]:
    """The text of the manual's motion program examples 1 to 6 (chapter VIII)."""
    return {number: (EXAMPLES / f"example{number}.m1486").read_text() for number in range(1, 7)}

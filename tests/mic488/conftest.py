"""Fixtures of the tests of the MIC488."""

from __future__ import annotations

import pytest
from mic488_rig import Rig


@pytest.fixture
def rig() -> Rig:
    """A controller with M1 enabled."""
    rig = Rig()
    rig.enable(1)
    return rig

from __future__ import annotations

import pytest
from world_rig import Run, m1486_run, mic488_run

from steptwin.m1486.lines import DUAL_DAC

# Runs that nobody changes any more.


@pytest.fixture(scope="session")
def mic488() -> Run:
    return mic488_run()


@pytest.fixture(scope="session")
def m1486() -> Run:
    return m1486_run()


@pytest.fixture(scope="session")
def m1486_with_converters() -> Run:
    return m1486_run(DUAL_DAC)

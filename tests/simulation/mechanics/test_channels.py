"""How axes are shown in traces."""

from __future__ import annotations

import pytest

from steptwin.m1486.chip import M1486Chip
from steptwin.m1486.lines import interface
from steptwin.m1486.variants import variant
from steptwin.simulation.kinds.m1486.kind import AXIS, M1486
from steptwin.simulation.mechanics.channels import AxisChannel, Mechanics, MovedChannel, PhaseOutputs, StepOutputs, plain_view


def test_a_chip_is_shown_in_full_steps_with_pulses_of_1800_ns() -> None:
    """Low pulses (chapter III); it has DIRECTION itself."""
    channel = M1486.channels(M1486Chip(variant("B"), interface=interface("sd")))[AXIS]
    assert channel == AxisChannel("axis", "step", 64.0, StepOutputs("STEP", None, True, 1800))


@pytest.mark.parametrize("name", ["dual", "two"])
def test_chips_with_converters_have_phase_currents(name: str) -> None:
    channel = M1486.channels(M1486Chip(variant("B"), interface=interface(name)))[AXIS]
    assert channel.outputs == PhaseOutputs(("PHASE1", "PHASE2"), 1, "N")


def test_names_of_columns() -> None:
    channel = AxisChannel("M1", "mm", 100.0, mechanics=Mechanics("x", "mm", 100.0))
    assert (channel.position_name, channel.counted_name, channel.velocity_name) == (
        "M1_position_mm",
        "M1_since_power_on_mm",
        "M1_velocity_mm_s",
    )
    assert channel.mechanics is not None
    assert channel.mechanics.position_name == "x_true_position_mm"
    assert (channel.mechanics.zero_p, channel.mechanics.is_ideal) == (0, True)


def test_an_axis_of_which_nothing_is_known() -> None:
    assert plain_view("3") == AxisChannel("M3", "imp", 1.0, StepOutputs("M3_STEP", "M3_DIR", False, 5000))


def test_how_steep_a_moved_channel_is() -> None:
    """Also from its last point through the end of a turn to the first one."""
    assert MovedChannel("s", "angle", "degree", 2.0).steepest == 1.0
    points = ((30.0, 1.0), (90.0, 4.0), (300.0, 7.0))
    assert MovedChannel("f", "position", "mm", 2.0, points=points).steepest == 6 / 90
    assert MovedChannel("f", "position", "mm", 2.0, points=points, turn=390.0).steepest == 3 / 60

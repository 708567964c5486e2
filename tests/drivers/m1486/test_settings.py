"""The settings that a driver has made, and how long motions take with them. Numbers are those of chapters VII.2 and VII.4."""

from __future__ import annotations

from dataclasses import fields

import pytest

from steptwin.drivers.m1486.settings import COMMANDS, ChipSettings, after_reset, checked_number
from steptwin.errors import Misuse
from steptwin.m1486.lines import DUAL_DAC, STEP_DIRECTION, TWO_DACS
from steptwin.m1486.variants import variant

B, B_24_MHZ = variant("B"), variant("B2x")
RAMP = ChipSettings(start_stop=200, acceleration=1000, velocity=700, profile=20000, microstep=1, qualification=1)
"""Half a second and 225 steps up to 700 step/s, in a straight ramp: P is never reached."""


@pytest.mark.parametrize(("interface", "microstep"), [(STEP_DIRECTION, 1), (DUAL_DAC, 4), (TWO_DACS, 4)])
def test_m_3_after_a_reset(interface: object, microstep: int) -> None:
    """S and A are decided (M-3); the sine is the first of the characteristics."""
    assert after_reset(B, interface) == ChipSettings(  # type: ignore[arg-type]
        start_stop=200, acceleration=5000, velocity=1000, profile=25000, microstep=microstep, qualification=1, waveform=1
    )


def test_each_setting_has_its_command() -> None:
    assert {field.name for field in fields(ChipSettings)} == set(COMMANDS)


def test_distances_are_multiples_of_a_microstep() -> None:
    assert [ChipSettings(microstep=m).grid_u for m in (None, 1, 4, 64)] == [64, 64, 16, 1]


def test_the_duration_of_a_move_with_ramps_and_without() -> None:
    thousand_steps = 64_000
    assert RAMP.travel_s(thousand_steps, B) == pytest.approx(0.5 + 550 / 700 + 0.5, abs=1e-8)
    assert RAMP.travel_s(-thousand_steps, B) == RAMP.travel_s(thousand_steps, B)
    assert RAMP.with_(velocity=100).travel_s(thousand_steps, B) == 10.0
    assert RAMP.travel_s(0, B) == 0.0


def test_at_24_mhz_everything_takes_half_the_time() -> None:
    assert RAMP.travel_s(64_000, B_24_MHZ) == pytest.approx((1.0 + 550 / 700) / 2, abs=1e-8)


def test_q_limits_the_speed() -> None:
    """Q4: 3000 step/s, Q2: 6000 step/s; without a ramp."""
    fast = ChipSettings(start_stop=9000, acceleration=1000, velocity=9000, profile=25000, microstep=4, qualification=4)
    assert fast.travel_s(64 * 9000, B) == 3.0
    assert fast.with_(microstep=8, qualification=2).travel_s(64 * 9000, B) == 1.5
    assert fast.with_(microstep=4, qualification=1).travel_s(64 * 9000, B) == 1.0


@pytest.mark.parametrize("unknown", ["start_stop", "acceleration", "velocity", "profile", "qualification"])
def test_a_duration_is_not_known_without_all_that_it_depends_on(unknown: str) -> None:
    assert RAMP.with_(**{unknown: None}).travel_s(64, B) is None
    assert RAMP.with_(microstep=None, waveform=None).travel_s(64, B) is not None


def test_m_and_q_have_to_go_together() -> None:
    with pytest.raises(Misuse, match=r"^M8 does not permit Q4: permitted are Q1, Q2$"):
        RAMP.with_(microstep=8, qualification=4).check()
    RAMP.with_(microstep=8, qualification=2).check()
    RAMP.with_(microstep=8, qualification=None).check()
    RAMP.with_(microstep=None, qualification=4).check()


def test_numbers_of_commands() -> None:
    assert checked_number("v", 700.0, B, "velocity") == 700
    with pytest.raises(Misuse, match=r"^velocity = 700\.5: M1486B takes "):
        checked_number("v", 700.5, B, "velocity")
    with pytest.raises(Misuse, match=r"^velocity = inf: M1486B takes "):
        checked_number("v", float("inf"), B, "velocity")
    with pytest.raises(Misuse, match=r"^microstep = 3: M1486B takes .*1, 2, 4, 8, 16, 32"):
        checked_number("m", 3, B, "microstep")

"""Digital inputs with polarity and filter, analog inputs with their scale, outputs."""

from __future__ import annotations

from dataclasses import replace

import pytest
from mic488_rig import OUT, Rig, controller

from steptwin.controller import MILLISECOND, PinEdge
from steptwin.errors import Misuse
from steptwin.mic488.config import AnalogConfig, ControllerConfig, InputConfig
from steptwin.mic488.inputs import Inputs


def with_input(number: int, **settings: int) -> Rig:
    """A controller whose input ``number`` (from 1) is configured."""
    inputs = [InputConfig()] * 20
    inputs[number - 1] = InputConfig(**settings)
    return Rig(replace(ControllerConfig(), inputs=tuple(inputs)))


def shown(rig: Rig, number: int) -> int:
    return rig.bits(2, 5000 + number - 1, 1)[0]


@pytest.mark.parametrize(("code", "milliseconds"), [(0, 10), (1, 50), (2, 100), (3, 250), (4, 500)])
def test_a_change_shows_after_the_filter_time(code: int, milliseconds: int) -> None:
    rig = with_input(3, filter=code)
    rig.pin("IN3", 1)
    rig.wait_ns(milliseconds * MILLISECOND - 1)
    assert shown(rig, 3) == 0
    rig.wait_ns(1)
    assert shown(rig, 3) == 1
    rig.pin("IN3", 0)
    rig.wait_ns(milliseconds * MILLISECOND - 1)
    assert shown(rig, 3) == 1
    rig.wait_ns(1)
    assert shown(rig, 3) == 0


def test_what_is_shorter_than_the_filter_time_does_not_show() -> None:
    rig = with_input(1, filter=1)
    for _ in range(20):
        rig.pin("IN1", 1)
        rig.wait(0.049)
        assert shown(rig, 1) == 0
        rig.pin("IN1", 0)
        rig.wait(0.001)
    rig.wait(1.0)
    assert shown(rig, 1) == 0
    assert rig.scheduler.deadline() is None


def test_a_level_that_goes_back_is_nothing_that_is_due() -> None:
    inputs = Inputs([InputConfig(), InputConfig(filter=1)])
    assert inputs.set_pin(0, True, 0)
    assert inputs.set_pin(1, True, 0)
    assert inputs.set_pin(0, False, MILLISECOND)
    assert inputs.deadline() == 50 * MILLISECOND
    assert inputs.settle(50 * MILLISECOND) == [1]
    assert (inputs.filtered, inputs.deadline()) == ([False, True], None)


def test_bouncing_starts_the_filter_time_anew() -> None:
    rig = with_input(1)
    rig.pin("IN1", 1)
    rig.wait(0.008)
    rig.pin("IN1", 0)
    rig.pin("IN1", 1)
    rig.wait(0.008)
    assert shown(rig, 1) == 0
    rig.wait(0.002)
    assert shown(rig, 1) == 1


def test_setting_the_level_it_has_does_not_start_the_filter_time_anew() -> None:
    rig = with_input(1)
    rig.pin("IN1", 1)
    rig.wait(0.008)
    rig.pin("IN1", 1)
    rig.wait(0.002)
    assert shown(rig, 1) == 1


def test_polarity() -> None:
    rig = with_input(20, level=1)
    assert rig.bits(2, 5000, 20) == [0] * 19 + [1]  # at once at power-on
    rig.pin("IN20", 1)
    rig.wait(0.010)
    assert shown(rig, 20) == 0
    assert rig.pins()["IN20"] == 1.0  # the terminal itself


def test_every_input_has_its_address() -> None:
    rig = Rig()
    for number in range(1, 21):
        rig.pin(f"IN{number}", 1)
        rig.wait(0.010)
        assert rig.bits(2, 5000, 20) == [1] * number + [0] * (20 - number)


def test_inputs_that_change_at_different_times_settle_at_different_times() -> None:
    rig = Rig()
    rig.pin("IN1", 1)
    rig.wait(0.004)
    rig.pin("IN2", 1)
    rig.wait(0.006)
    assert rig.bits(2, 5000, 2) == [1, 0]
    rig.wait(0.004)
    assert rig.bits(2, 5000, 2) == [1, 1]


def test_pin_names_in_either_case() -> None:
    rig = Rig()
    rig.pin("in5", 1)
    rig.pin("ain2", 3.5)
    assert (rig.pins()["IN5"], rig.pins()["AIN2"]) == (1.0, 3.5)


@pytest.mark.parametrize(
    ("pin", "value", "message"),
    [
        ("IN1", 0.5, "IN1 = 0.5: a digital input is 0 or 1"),
        ("IN1", float("nan"), "IN1 = nan: a digital input is 0 or 1"),
        ("AIN1", -0.1, "AIN1 = -0.1 V: an analog input takes 0 to 10 V"),
        ("AIN2", 10.5, "AIN2 = 10.5 V: an analog input takes 0 to 10 V"),
        ("AIN2", float("nan"), "AIN2 = nan V: an analog input takes 0 to 10 V"),
        ("IN21", 1, "no input pin 'IN21': inputs are IN1 to IN20 and AIN1 to AIN2"),
        ("OUT1", 1, "no input pin 'OUT1': inputs are IN1 to IN20 and AIN1 to AIN2"),
    ],
)
def test_what_an_input_cannot_be_is_misuse(pin: str, value: float, message: str) -> None:
    rig = Rig()
    before = dict(rig.pins())
    with pytest.raises(Misuse) as raised:
        rig.device.set_pin(pin, value, 0)
    assert str(raised.value) == message
    assert dict(rig.pins()) == before


def test_analog_inputs_are_scaled_from_lo_val_to_hi_val() -> None:
    rig = Rig(controller(analog=(AnalogConfig(), AnalogConfig(lo_val=100.0, hi_val=-100.0))))
    assert (rig.device.analog(0), rig.device.analog(1)) == (0.0, 100.0)
    rig.pin("AIN1", 4.2)
    rig.pin("AIN2", 7.5)
    assert rig.device.analog(0) == pytest.approx(4.2)
    assert rig.device.analog(1) == -50.0
    rig.pin("AIN2", 10)
    assert rig.device.analog(1) == -100.0


def test_outputs_are_set_read_and_told_as_edges() -> None:
    rig = Rig()
    for number in (1, 3, 8):
        rig.wait(1.0)
        rig.coil(OUT + number - 1, True)
        rig.coil(OUT + number - 1, True)
    assert rig.bits(1, 6000, 8) == [1, 0, 1, 0, 0, 0, 0, 1]
    assert rig.bits(1, 6002, 6) == [1, 0, 0, 0, 0, 1]
    rig.coil(OUT + 2, False)
    second = 1000 * MILLISECOND
    assert rig.edges == [
        PinEdge(second, "OUT1", 1.0),
        PinEdge(2 * second, "OUT3", 1.0),
        PinEdge(3 * second, "OUT8", 1.0),
        PinEdge(3 * second, "OUT3", 0.0),
    ]

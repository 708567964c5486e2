"""Names of other controllers and languages, and the registers that they were meant for."""

from __future__ import annotations

import pytest

from steptwin.wbc.dialect import DEFAULT
from steptwin.wbc.mistaken import register_meant

MEANT = {
    "OUT2": "OUTPUT OUTP DO DOUT Q",
    "IN2": "INPUT INP DI DIN",
    "AIN2": "AI ADC ANALOG AINPUT",
    "VmaxM2": "VMAX VEL VELM SPEED SPEEDM VELOCITYM VMX",
    "StatM2": "STATUS STATUSM STAT",
    "LimLM2": "LIML LIMITL LIMITLM",
    "LimRM2": "LIMR LIMITR LIMITRM",
    "AccM2": "ACC ACCEL ACCELM",
    "DecM2": "DEC DECEL DECELM",
    "PosM2": "POS POSITIONM",
    "M2": "MOTOR DRIVE AXIS",
    "ENC2": "ENCODER ENCM",
    "TIMA2": "TIMER TIM TMR",
    "CFGINT_IN2": "CFGINT INT_IN CFG_IN",
    "VactM2": "VACT",
    "PTPM2": "PTP",
    "$I2": "I",
    "$D2": "D",
    "$R2": "R",
}


@pytest.mark.parametrize(("meant", "words"), MEANT.items())
def test_words_for_registers(meant: str, words: str) -> None:
    number = "2" if meant[0] != "$" else "12"
    register = meant if meant[0] != "$" else f"{meant[:2]}12"
    assert {register_meant(f"{word}{number}", DEFAULT) for word in words.split()} == {register}


@pytest.mark.parametrize("name", ["DO", "DO0", "DO9", "DO99999", "OUT1", "XDO1", "DO1X", "I4000"])
def test_what_is_no_such_word_means_nothing(name: str) -> None:
    assert register_meant(name, DEFAULT) is None


def test_only_asked_families_are_looked_at() -> None:
    assert register_meant("DO1", DEFAULT, {"DI"}) is None
    assert register_meant("DO1", DEFAULT, {"DO"}) == "OUT1"

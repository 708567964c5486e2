"""Names without their M or $, and those of the other manuals, and the registers that they were meant for."""

from __future__ import annotations

import pytest

from steptwin.wbc.dialect import DEFAULT
from steptwin.wbc.mistaken import register_meant

MEANT = {"OUTPUT2": "OUT2", "INPUT2": "IN2", "VMAX2": "VmaxM2", "ACC2": "AccM2", "DEC2": "DecM2", "POS2": "PosM2",
         "I12": "$I12", "D12": "$D12", "R12": "$R12"}  # fmt: skip


@pytest.mark.parametrize(("name", "register"), MEANT.items())
def test_words_for_registers(name: str, register: str) -> None:
    assert register_meant(name, DEFAULT) == register


@pytest.mark.parametrize("name", ["OUTPUT", "OUTPUT0", "OUTPUT9", "OUTPUT99999", "OUT1", "XOUTPUT1", "OUTPUT1X", "I4000"])
def test_what_is_no_such_word_means_nothing(name: str) -> None:
    assert register_meant(name, DEFAULT) is None


def test_only_asked_families_are_looked_at() -> None:
    assert register_meant("OUTPUT1", DEFAULT, {"INPUT"}) is None
    assert register_meant("OUTPUT1", DEFAULT, {"OUTPUT"}) == "OUT1"

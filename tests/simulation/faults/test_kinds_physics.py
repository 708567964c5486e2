"""How many bytes a power failure leaves unwritten, where chance decides."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from steptwin.simulation.faults import KINDS
from steptwin.simulation.faults.effects import SaveEffect


@pytest.mark.parametrize("written", [0, 1, 3])
def test_from_no_byte_to_all_are_written_before_a_power_cut(written: int) -> None:
    effect, told, asked = KINDS["power-cut"].effect, [], []

    def below(limit: int) -> int:
        asked.append(limit)
        return written

    active: Any = SimpleNamespace(
        fault=SimpleNamespace(whole=lambda name: None), chance=SimpleNamespace(below=below), ns=lambda name: 5
    )
    controller: Any = SimpleNamespace(report=lambda active, now, text: told.append(text), cut_supply=lambda now, until: None)
    kept = bytearray(b"new")
    assert isinstance(effect, SaveEffect)
    effect.act(active, controller, b"old", kept, 0)
    assert asked == [4]
    assert kept == b"new"[:written] + b"old"[written:]
    assert told == [f"no supply after {written} of 3 bytes were saved"]


def test_a_memory_of_which_all_is_worn_out_goes_on_so() -> None:
    effect, told = KINDS["wear"].effect, []
    fault = SimpleNamespace(whole=lambda name: 0)
    active: Any = SimpleNamespace(fault=fault, struck=5, worn=[1], chance=SimpleNamespace(below=lambda limit: limit - 1))
    controller: Any = SimpleNamespace(report=lambda active, now, text: told.append(text))
    assert isinstance(effect, SaveEffect)
    for _ in range(3):
        kept = bytearray(b"ab")
        effect.act(active, controller, b"AB", kept, 0)
        assert kept == b"AB"
    assert told == ["after 5 saves byte 0 is worn out"]

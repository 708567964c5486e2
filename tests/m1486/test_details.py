"""What a chip tells of itself besides its axis: numbers of the manual, chapter II (memory)."""

from __future__ import annotations

import pytest
from m1486_rig import Bench

from steptwin.controllerstate import details_of
from steptwin.m1486.details import DETAILS, used_bits


@pytest.mark.parametrize(("command", "bits"), [("r", 8), ("l5", 16), ("a1000", 24), ("f500", 32)])
def test_a_file_uses_the_bits_that_its_commands_take(command: str, bits: int) -> None:
    """As in the examples of chapter II; the rest of the file is a W of 32 bits."""
    bench = Bench("B")
    bench.file(command, "w500")
    assert used_bits(bench.chip) == bits + 32


def test_m_12_all_of_the_memory_is_used_once_the_ring_has_come_round() -> None:
    """63 commands of 32 bits leave 16 of the 2032 bits of a B."""
    bench = Bench("B", statement_ns=0)
    for count in range(1, 64):
        bench.do("f64")
        assert used_bits(bench.chip) == 32 * count
    bench.do("f64")
    assert used_bits(bench.chip) == 2032


@pytest.mark.parametrize(
    ("lines", "distance", "direction"),
    [(["f64"], 64, 1), (["b64"], -64, -1), (["g+"], None, 1), (["g-"], None, -1), (["f64", "r", "g64"], 0, 1)],
)
def test_the_next_motion(lines: list[str], distance: int | None, direction: int) -> None:
    bench = Bench("B")
    bench.do(*lines)
    facts = details_of(DETAILS, bench.chip, bench.now)
    assert (facts["next_distance"], facts["next_direction"]) == (distance, direction)

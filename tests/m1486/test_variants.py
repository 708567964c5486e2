from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.m1486.variants import VARIANTS, Store, Variant, variant

# Chapters II (Memory, Serial interface), VII.1 (Address, Upload), X of the manual.
FAMILY = {
    # name: labels, input bits, memory bits, store, type letter
    "A": (15, 96, 864, Store.RAM, 0x41),
    "B": (80, 256, 2032, Store.RAM, 0x42),
    "E1": (80, 256, 2000, Store.EEPROM, 0x45),
    "E2": (80, 256, 4000, Store.EEPROM, 0x46),
}


@pytest.mark.parametrize("name", FAMILY)
@pytest.mark.parametrize("clock", ["", "2x"])
def test_family_members_have_the_sizes_of_the_manual(name: str, clock: str) -> None:
    v = variant(name + clock)
    assert (v.labels, v.input_bits, v.memory_bits, v.store, v.type_letter) == FAMILY[name]
    assert v.clock == (2 if clock else 1)


def test_c_is_an_a_with_more_memory_and_four_pwm_outputs() -> None:
    a, c = variant("A"), variant("C")
    assert (c.labels, c.input_bits, c.store, c.shared_bits) == (a.labels, a.input_bits, a.store, a.shared_bits)
    assert (c.memory_bits, c.pwm_outputs, a.pwm_outputs) == (4000, 4, 0)


def test_m_15_type_letter_of_c() -> None:
    assert variant("C").type_letter == 0x43


@pytest.mark.parametrize("v", VARIANTS, ids=lambda v: v.name)
def test_m_3_defaults_of_start_stop_and_acceleration(v: Variant) -> None:
    assert (v.start_stop, v.acceleration) == (200, 5000)


def test_m_19_one_command_takes_a_millisecond_and_half_of_it_at_24_mhz() -> None:
    assert variant("B").statement_ns == 1_000_000
    assert variant("B2x").statement_ns == 500_000


def test_baud_is_chosen_by_two_pins_and_doubled_at_24_mhz() -> None:
    pins = [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert [variant("A").baud(*p) for p in pins] == [300, 1200, 2400, 4800]
    assert [variant("A2x").baud(*p) for p in pins] == [600, 2400, 4800, 9600]


def test_e_types_have_no_address_0_no_shutdown_and_need_time_for_their_eeprom() -> None:
    for name, erase_s in (("E1", 1), ("E2", 2)):
        v = variant(name)
        assert v.addresses == range(1, 16)
        assert not v.has_shutdown
        assert v.erase_ns == erase_s * 10**9
        assert v.write_ns == 5 * 10**8
    assert variant("A").addresses == range(16)


def test_only_a_and_c_keep_registers_in_the_command_memory() -> None:
    assert {v.name for v in VARIANTS if v.shared_bits} == {"A", "A2x", "C", "C2x"}
    assert variant("A").memory_bits - variant("A").shared_bits == 736


def test_names_are_read_in_any_case_and_in_full() -> None:
    assert variant("e12X") is variant("M1486E12x")
    with pytest.raises(Misuse, match=r"'D'; there are A, B, C, E1, E2, A2x"):
        variant("D")

"""The pins by their names, and those of the driver interface."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.m1486.lines import INTERFACES, Interface
from steptwin.m1486.pins import CONTROL_PINS, LINE_PINS, refuse_taken


@pytest.mark.parametrize("interface", INTERFACES, ids=lambda interface: interface.name)
def test_m_21_only_lines_of_the_driver_interface_are_taken(interface: Interface) -> None:
    refused = set()
    for pin in (*LINE_PINS, *CONTROL_PINS):
        try:
            refuse_taken(pin, interface)
        except Misuse:
            refused.add(pin)
    assert refused == {f"B{line}" for line in interface.occupied}


def test_a_pin_that_is_taken_is_told_with_those_of_the_interface() -> None:
    (_, dual, _) = INTERFACES
    with pytest.raises(Misuse, match=r"^B12 is taken: the Dual DAC interface has B10 to B17$"):
        refuse_taken("B12", dual)

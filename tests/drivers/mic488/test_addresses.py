"""Values by their address: what is meant by it, without a device."""

from __future__ import annotations

import pytest

from steptwin.drivers.mic488.addresses import places
from steptwin.errors import Misuse
from steptwin.mic488.registers import FIRMWARES, register_map

MAP = register_map("1.70")
M1_POS_ACT = 10020
"""Read by the examples of the manual (3.2)."""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("10020", ["M1_POS_ACT"]),
        ("2000", ["M1_EN"]),
        ("5000", ["IN1"]),
        ("12", ["USER_REGISTER[12]"]),
        ("hr:10020", ["hr:10020:word"]),
        ("HR:10020:REAL", ["hr:10020:real"]),
        ("hr:10020-10023:real", ["hr:10020:real", "hr:10022:real"]),
        ("10020-10021:hex", ["hr:10020:hex", "hr:10021:hex"]),
        ("co:2000-2002", ["co:2000", "co:2001", "co:2002"]),
        ("di:5000", ["di:5000"]),
        ("hr:65535:int", ["hr:65535:int"]),
        ("hr:9999:dint", ["hr:9999:dint"]),
        ("M1_POS_ACT", None),
        ("USER_REGISTER[4]:real", None),
        ("M?_ACC", None),
    ],
)
def test_what_an_address_stands_for(text: str, expected: list[str] | None) -> None:
    found = places(text, MAP)
    assert (None if found is None else [str(one) for one in found]) == expected


@pytest.mark.parametrize("firmware", FIRMWARES)
def test_an_address_alone_names_one_register(firmware: str) -> None:
    """Coils, inputs and registers have no address in common."""
    taken = [address for one in register_map(firmware) for address in range(one.address, one.last + 1)]
    assert len(taken) == len(set(taken))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("10021", "10021 is the second word of M1_POS_ACT, which is at 10020; hr:10021 reads it"),
        ("9999", "firmware 1.70 has no register at 9999; hr:9999 reads it all the same"),
        ("hr:70000", "'hr:70000': permitted are addresses from 0 to 65535, the first not above the last"),
        ("hr:5-4", "the first not above the last"),
        ("xx:5", "'xx:5': expected ADDRESS, or hr:, co: or di: before it"),
        ("co:5:real", "expected ADDRESS"),
        ("hr:5:float", "expected ADDRESS"),
        ("hr:0-2:real", "a REAL takes 2 registers, 3 are not a multiple of it"),
        ("hr:65535:real", "a REAL takes 2 registers, and 65535 is the last address"),
        ("hr:0-60000", "at most 1000 values at once"),
    ],
)
def test_what_is_no_address(text: str, message: str) -> None:
    with pytest.raises(Misuse) as caught:
        places(text, MAP)
    assert message in str(caught.value)

"""Values by their address on the line: ``10020``, ``hr:10020``, ``hr:10020:real``, ``hr:10020-10023:hex``, ``di:5000-5007``.

An address without a space must be that of a register of the firmware, and is read with its type. With a space, any address
is read from the device.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from steptwin.drivers.mic488.sync import Mic488
from steptwin.errors import Misuse
from steptwin.mic488.encoding import word_to_int, words_to_dint, words_to_real
from steptwin.mic488.registermap import RegisterMap, Space
from steptwin.wire import pdu

SPACES = {"hr": 3, "co": 1, "di": 2}
"""Holding registers, coils and discrete inputs, with the function that reads them."""
FORMS = {"word": 1, "int": 1, "hex": 1, "dint": 2, "real": 2}
"""Forms in which holding registers are shown, and how many of them a value takes."""
FORM = "expected ADDRESS, or hr:, co: or di: before it and :word, :int, :dint, :real or :hex behind, such as hr:10020:real"
MOST = 1000
MOST_READ = 120
"""The most registers in one request. A frame carries 125; this is even, for 32-bit values."""
_ADDRESS = re.compile(
    r"(?:(?P<space>[a-z]+):)?(?P<first>\d{1,5})(?:-(?P<last>\d{1,5}))?(?::(?P<form>\w+))?", re.IGNORECASE | re.ASCII
)


class ValueAddress(NamedTuple):
    """One value by its address. ``form`` is empty for a coil or input; ``first`` and ``count`` are what is read with it.

    A range is read with one request: the two words of a 32-bit value at one moment.
    """

    space: str
    address: int
    form: str
    first: int
    count: int

    def __str__(self) -> str:
        return f"{self.space}:{self.address}{':' * bool(self.form)}{self.form}"


def places(text: str, registers: RegisterMap) -> list[ValueAddress] | list[str] | None:
    """The values at an address, or the name of the register there. None if the text is not an address.

    Raises `Misuse`.
    """
    match = _ADDRESS.fullmatch(text.strip())
    if match is None:
        return None
    first, last = int(match["first"]), int(match["last"] or match["first"])
    if not first <= last <= 0xFFFF:
        raise Misuse(f"{text!r}: permitted are addresses from 0 to 65535, the first not above the last")
    space, form = (match["space"] or "").lower(), (match["form"] or "").lower()
    if not space and not form and match["last"] is None:
        return [_register_at(registers, first)]
    space = space or "hr"
    if space not in SPACES or (form and (space != "hr" or form not in FORMS)):
        raise Misuse(f"{text!r}: {FORM}")
    form = "" if space != "hr" else form or "word"
    step = FORMS.get(form, 1)
    if (last - first) // step >= MOST:
        raise Misuse(f"{text!r}: at most {MOST} values at once")
    if last != first and (last - first + 1) % step:
        raise Misuse(f"{text!r}: a {form.upper()} takes {step} registers, {last - first + 1} are not a multiple of it")
    if last + (step - 1 if last == first else 0) > 0xFFFF:
        raise Misuse(f"{text!r}: a {form.upper()} takes {step} registers, and 65535 is the last address")
    end = last + 1 if last != first else first + step
    found = []
    for address in range(first, end, step):
        start = address - (address - first) % MOST_READ
        found.append(ValueAddress(space, address, form, start, min(end - start, MOST_READ)))
    return found


def _register_at(registers: RegisterMap, address: int) -> str:
    register = next((found for space in Space if (found := registers.find(space, address)) is not None), None)
    if register is None:
        raise Misuse(f"firmware {registers.firmware.name} has no register at {address}; hr:{address} reads it all the same")
    if register.cells > 1:
        return f"{register.name}[{address - register.address}]"
    if address != register.address:
        raise Misuse(f"{address} is the second word of {register.name}, which is at {register.address}; hr:{address} reads it")
    return register.name


def read_places(mic: Mic488, wanted: Iterable[ValueAddress]) -> dict[ValueAddress, Any]:
    """Read the values. Raises `ModbusRefusal` for addresses the device does not have."""
    content: dict[tuple[str, int, int], Sequence[int]] = {}
    values: dict[ValueAddress, Any] = {}
    for place in wanted:
        key = (place.space, place.first, place.count)
        if key not in content:
            answer = mic.request(pdu.ReadRequest(SPACES[place.space], place.first, place.count))
            match answer:
                case pdu.BitsResponse():
                    content[key] = pdu.unpack_bits(answer.packed, place.count)
                case pdu.RegistersResponse():
                    content[key] = answer.values
        values[place] = _value(place, content[key][place.address - place.first :])
    return values


def _value(place: ValueAddress, words: Sequence[int]) -> Any:
    match place.form:
        case "":
            return bool(words[0])
        case "hex":
            return f"{words[0]:04X}h"
        case "int":
            return word_to_int(words[0])
        case "dint":
            return words_to_dint(words[0], words[1])
        case "real":
            return words_to_real(words[0], words[1])
        case _:
            return words[0]

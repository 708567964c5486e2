"""M1486 chips on a line, parsed from options of commands: addresses, wires, pins."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

from steptwin.errors import Misuse
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.pins import OPEN_ADDRESS, known_pin, refuse_taken
from steptwin.m1486.variants import DEFAULT, Variant
from steptwin.simulation.describe.generated_m1486 import chip_name
from steptwin.simulation.scheduler.wires import PinName, Wire

_WIRE = re.compile(r"\s*([0-9A-Fa-f])\.([^.=]+)=\s*([0-9A-Fa-f])\.([^.=]+)\Z")


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """The chips of a line and the wires between them. Wires name chips by address, a hexadecimal digit."""

    variant: Variant = DEFAULT
    addresses: Sequence[int] = (OPEN_ADDRESS,)
    interface: Interface = STEP_DIRECTION
    wires: Sequence[Wire] = ()


def check_chain(chain: Chain, *, has_program: bool) -> None:
    """Raises `Misuse` for addresses that a type does not take, wires that its driver has taken, a program for several chips."""
    kind = chain.variant
    for wire in chain.wires:
        for end in (wire.source, wire.target):
            try:
                refuse_taken(end.pin, chain.interface)
            except Misuse as error:
                raise Misuse(f"--wire {wire.source}={wire.target}: {error}") from None
    if has_program and len(chain.addresses) > 1:
        raise Misuse(f"--program is for a single chip: --chain has {len(chain.addresses)}")
    for address in chain.addresses:
        if address not in kind.addresses:
            raise Misuse(
                f"address {address:X}: {kind.title} takes {kind.addresses[0]:X} to {kind.addresses[-1]:X}"
                " (with all address pins low it is reset instead of running its file)"
            )


def placed_wires(chain: Chain) -> list[tuple[str, str]]:
    """Both ends of the wires as a description names them."""
    return [(_placed(wire.source), _placed(wire.target)) for wire in chain.wires]


def _placed(end: PinName) -> str:
    return f"{chip_name(int(end.controller, 16))}.{end.pin}"


def parse_addresses(text: str) -> list[int]:
    """``0,7`` → addresses, hexadecimal digits. Raises `Misuse`."""
    addresses: list[int] = []
    for part in text.split(","):
        digit = part.strip().upper()
        if len(digit) != 1 or digit not in "0123456789ABCDEF":
            raise Misuse(f"--chain {text}: {digit!r} is not an address; permitted are 0 to 9 and A to F, separated by commas")
        if int(digit, 16) in addresses:
            raise Misuse(f"--chain {text}: {digit} is given twice")
        addresses.append(int(digit, 16))
    return addresses


def parse_wire(text: str) -> Wire:
    """``0.B1=7.B3`` → a wire from a pin of one chip to an input of another. Raises `Misuse`."""
    match = _WIRE.match(text)
    if match is None:
        raise Misuse(f"--wire {text}: expected FROM=TO with chips by address, such as 0.B1=7.B3")
    source = match[2].strip().upper()
    with suppress(Misuse):  # outputs that are no inputs are for the scheduler to know
        source = known_pin(source)
    return Wire(PinName(match[1].upper(), source), PinName(match[3].upper(), known_pin(match[4])))

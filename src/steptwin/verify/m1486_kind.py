"""An M1486 on a line, ready for its checks: `M1486_CHECKED`."""

from __future__ import annotations

from steptwin.controller import SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.kind import DeviceAddress
from steptwin.drivers.m1486.identify import SearchLine, scan_chips
from steptwin.drivers.m1486.lines import line_endpoint
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.m1486.variants import Store, Variant
from steptwin.m1486.variants import variant as variant_named
from steptwin.verify.check import CheckNeed
from steptwin.verify.kind import CheckedKind, ReadyChecks
from steptwin.verify.m1486 import CHECKS, ChipTalk
from steptwin.verify.unchecked import OF_M1486


class M1486Checked(CheckedKind[ChipTalk]):
    name = "m1486"
    unchecked = OF_M1486

    def prepare(
        self, address: DeviceAddress, permitted: frozenset[CheckNeed], move: tuple[int, float] | None
    ) -> ReadyChecks[ChipTalk]:
        if move:
            raise Misuse("no check moves an M1486: leave out --move")
        chip = _chip(address)
        if chip.store is Store.EEPROM and CheckNeed.WRITE not in permitted:
            raise Misuse(f"{chip.title} writes every command into its EEPROM, also those of checks: permit it with --write")
        about = {"kind": "M1486", "address": address.number, "type": chip.name, "baud": address.baud}
        talk = ChipTalk(address.number, chip, wait_s=address.timeout)
        return ReadyChecks(CHECKS, talk, line_endpoint(address.place, address.baud), lambda: about)


def _chip(address: DeviceAddress) -> Variant:
    """The type of the chip. Raises `LineFailure` if it does not respond, `Misuse` if the address does not select one."""
    if address.variant is not None:
        return variant_named(address.variant)
    line = SearchLine(address.place, baud=address.baud)
    finish(line.open())
    try:
        found = finish(scan_chips(line, baud=address.baud, timeout_ns=round(address.timeout * SECOND)))
    finally:
        finish(line.close())
    chips = [chip for chip in found if address.number in (None, chip.address)]
    if not chips:
        where = "" if address.number is None else f" with address {address.number:X}"
        raise LineFailure(f"{address.place}: no M1486{where} responds at {address.baud} bit/s; it may move or run a program")
    if len(chips) > 1:
        raise Misuse(f"{address.place} has several chips: choose one, such as ,chip={chips[0].address:X}")
    if chips[0].variant is None:
        raise Refusal(f"{address.place}: the chip is busy")
    return variant_named(chips[0].variant)


M1486_CHECKED = M1486Checked()

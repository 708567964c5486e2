"""A MIC488 on a line, ready for its checks: `MIC488_CHECKED`."""

from __future__ import annotations

from steptwin.controller import SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.kind import DeviceAddress
from steptwin.drivers.lineaddress import parse_line_address
from steptwin.drivers.mic488.identify import firmware_of
from steptwin.drivers.mic488.kind import unit_of
from steptwin.drivers.mic488.lines import ThreadModbusLine
from steptwin.errors import Misuse
from steptwin.mic488.registers import AXES, register_map
from steptwin.verify.check import CheckNeed
from steptwin.verify.kind import CheckedKind, ReadyChecks
from steptwin.verify.mic488 import CHECKS
from steptwin.verify.modbus import ModbusTalk
from steptwin.verify.unchecked import OF_MIC488


class Mic488Checked(CheckedKind[ModbusTalk]):
    name = "mic488"
    unchecked = OF_MIC488

    def prepare(
        self, address: DeviceAddress, permitted: frozenset[CheckNeed], move: tuple[int, float] | None
    ) -> ReadyChecks[ModbusTalk]:
        axis, distance_u = _checked_move(move)
        firmware = address.variant or _firmware(address)
        place = parse_line_address(address.place, address.baud)
        talk = ModbusTalk(
            unit_of(address),
            register_map(firmware),
            framed=place.framed,
            wait_s=address.timeout,
            is_detected=address.variant is None,
            axis=axis,
            distance_u=distance_u,
        )

        def about() -> dict[str, object]:
            shown = "1.70 or 1.40" if talk.may_be_older else firmware
            rate = {} if place.serial is None else {"baud": address.baud}
            return {"kind": "MIC488", "unit": unit_of(address), "firmware": shown, **rate}

        return ReadyChecks(CHECKS, talk, place.endpoint, about)


def _checked_move(move: tuple[int, float] | None) -> tuple[int, float]:
    if move is None:
        return 1, 0.0
    axis, distance_u = move
    if not 1 <= axis <= AXES:
        raise Misuse(f"axis {axis}: permitted are 1 to {AXES}")
    if not 0.0 < abs(distance_u) < 1e9:
        raise Misuse(f"a distance of {distance_u:g} units: permitted are numbers other than 0")
    return move


def _firmware(address: DeviceAddress) -> str:
    line = ThreadModbusLine(address.place, baud=address.baud)
    finish(line.open())
    try:
        return finish(firmware_of(line, unit_of(address), round(address.timeout * SECOND)))
    finally:
        finish(line.close())


MIC488_CHECKED = Mic488Checked()

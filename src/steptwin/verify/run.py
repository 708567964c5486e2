"""Checks over a real line, in a thread that waits."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from steptwin.drivers.blocking import finish
from steptwin.drivers.kind import DeviceAddress
from steptwin.drivers.m1486.identify import SearchLine, scan_chips
from steptwin.drivers.m1486.lines import line_endpoint
from steptwin.drivers.mic488.identify import firmware_of
from steptwin.drivers.mic488.kind import unit_of
from steptwin.drivers.mic488.lines import ThreadModbusLine
from steptwin.drivers.place import Channel, Endpoint, parse_line_address
from steptwin.errors import LineFailure, Misuse, Refusal
from steptwin.m1486.variants import Store, Variant
from steptwin.m1486.variants import variant as variant_named
from steptwin.machine import SECOND
from steptwin.mic488.registers import AXES, register_map
from steptwin.verify.check import Check, Need, NotRestored, Result, Steps
from steptwin.verify.m1486 import CHECKS as OF_M1486
from steptwin.verify.m1486 import ChipTalk
from steptwin.verify.mic488 import CHECKS as OF_MIC488
from steptwin.verify.modbus import ModbusTalk
from steptwin.verify.report import Report
from steptwin.verify.running import Progress, T, check_all, complete

PAUSE_S = 0.01
"""Between two requests: a MIC488 serves 100 a second (manual 2)."""
R = TypeVar("R")


def verify(
    address: DeviceAddress,
    now: str,
    version: str,
    *,
    write: bool = False,
    move: tuple[int, float] | None = None,
    progress: Progress = lambda id_, number, count: None,
    is_cancelled: Callable[[], bool] = lambda: False,
) -> Report:
    """Check a controller.

    ``now`` (ISO 8601) and ``version`` (of steptwin) are for the report; ``move``: an axis of a MIC488 and how far it may move.

    Raises `Misuse`, `Refusal`, `LineFailure`.
    """
    permitted = frozenset({Need.READ, *((Need.WRITE,) if write else ()), *((Need.MOVE,) if move else ())})
    if address.kind == "m1486":
        if move:
            raise Misuse("no check moves an M1486: leave out --move")
        chip = _chip(address)
        if chip.store is Store.EEPROM and not write:
            raise Misuse(f"{chip.title} writes every command into its EEPROM, also those of checks: permit it with --write")
        chip_talk = ChipTalk(address.number, chip, wait_s=address.timeout)
        endpoint = line_endpoint(address.place, address.baud)
        results, is_complete = _over(endpoint, chip_talk, OF_M1486, permitted, progress, is_cancelled)
        of_device = {"kind": "M1486", "address": address.number, "type": chip.name, "baud": address.baud}
    else:
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
        results, is_complete = _over(place.endpoint, talk, OF_MIC488, permitted, progress, is_cancelled)
        of_device = {"kind": "MIC488", "unit": unit_of(address), "firmware": "1.70 or 1.40" if talk.may_be_older else firmware}
        if place.serial is not None:
            of_device["baud"] = address.baud
    names = ", ".join(need.name.lower() for need in sorted(permitted))
    return Report({**of_device, "at": address.place}, version, now, names, complete(address.kind, results), is_complete)


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


# ---------------------------------------------------------------------- the line


def _over(
    endpoint: Endpoint,
    talk: T,
    checks: Sequence[Check[T]],
    permitted: frozenset[Need],
    progress: Progress,
    is_cancelled: Callable[[], bool],
) -> tuple[list[Result], bool]:
    """The results, and whether these are all."""
    channel = endpoint.open()
    try:
        results = carry_out(channel, check_all(talk, checks, permitted, progress=progress, is_cancelled=is_cancelled))
    except NotRestored:
        raise
    except LineFailure as failure:
        if not talk.probes.unrestored:
            raise
        raise NotRestored(f"{failure}; not put back: {'; '.join(talk.probes.unrestored.values())}") from failure
    except KeyboardInterrupt:
        if not talk.probes.unrestored:
            raise
        raise NotRestored(f"interrupted; not put back: {'; '.join(talk.probes.unrestored.values())}") from None
    finally:
        channel.close()
    return results, len(results) == len(checks)


def carry_out(channel: Channel, steps: Steps[R]) -> R:
    """What the steps return."""
    try:
        send = next(steps)
        while True:
            if not send.at_once:
                _drain(channel)
            received = b""
            if send.data:
                channel.write(send.data)
            end = time.monotonic() + send.wait_s
            while (left_s := end - time.monotonic()) > 0.0 and not (received and send.is_whole(received)):
                received += channel.read(left_s)
            send = steps.send(received)
    except StopIteration as done:
        return done.value


def _drain(channel: Channel) -> None:
    """Wait the pause between two requests, and drop what comes late."""
    end = time.monotonic() + PAUSE_S
    while (left_s := end - time.monotonic()) > 0.0:
        channel.read(left_s)

"""Find controllers by slave address, and their firmware by its address map."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from steptwin.controller import MILLISECOND, Nanos
from steptwin.drivers.exchange import Job, LineLost
from steptwin.drivers.line import DriverLine
from steptwin.drivers.mic488.failures import ModbusRefusal, NoMic488
from steptwin.drivers.modbus import ModbusQuery, words
from steptwin.errors import LineFailure, Refusal
from steptwin.messages import Message, text_of
from steptwin.mic488.registermap import RegisterMap
from steptwin.mic488.registers import AXES, register_map
from steptwin.wire import pdu

SCAN_NS: Nanos = 100 * MILLISECOND
"""Time a scan waits for a unit, in addition to the time on the wire, ns: USB adapters delay bytes by 16 ms and more."""
PROBE_TRIES = 2

_GATEWAY_CODES = (0x0A, pdu.GATEWAY_TARGET_FAILED)
_VAGUE_CODES = (pdu.DEVICE_FAILURE, pdu.DEVICE_BUSY)
"""Exceptions that some gateways answer in place of these where there is no device."""
_NO_UNIT = 248
"""A unit that no device has: slave addresses end at 247. A gateway for which it answers passes every number on to one device."""
_NEW, _OLD = "1.70", "1.23"
"""One firmware for each address map. At the addresses of 1.23 the others have user registers, which can be read. 1.40 has the
addresses of 1.70, and no read distinguishes them."""


class FoundUnit(NamedTuple):
    """A unit that responds. ``firmware`` is None if it is not a MIC488. ``every_unit``: so does a unit that no device has."""

    unit: int
    firmware: str | None
    every_unit: bool = False


NO_MIC488 = Message(
    "drivers.mic488.no-mic488", "{place}: unit {unit} responds, but does not have the registers of a MIC488 ({why})"
)
IMPLAUSIBLE = Message("drivers.mic488.implausible-values", "implausible values")


async def firmware_of(line: DriverLine[ModbusQuery, bytes], unit: int, timeout_ns: Nanos) -> str:
    """The firmware whose addresses a controller has: ``1.70`` (which may be 1.40) or ``1.23``.

    A real controller may be silent where another refuses, so a missing answer counts as a refusal if the other address map is
    answered. Raises `NoMic488` if both are refused, the `LineFailure` if there is no answer at all, `ModbusRefusal` if a
    gateway reports that no device responds.
    """
    refusal: Refusal | None = None
    failure: LineFailure | None = None

    async def answers(name: str) -> bool:
        nonlocal refusal, failure
        registers = register_map(name)
        first, last = registers.of("DATA_TYPE"), registers.of("STATUS", AXES)
        request = pdu.ReadRequest(pdu.READ_HOLDING_REGISTERS, first.address, last.last - first.address + 1)
        query = ModbusQuery(unit, request, lambda _: f"read the control registers of firmware {name}")
        try:
            answer = await line.exchange(Job(query, timeout_ns, most_attempts=PROBE_TRIES))
        except pdu.ModbusException as exception:
            refusal = ModbusRefusal(line.place, query, exception)
            if exception.code in _GATEWAY_CODES:
                raise refusal from None
            return False
        except LineLost:
            raise
        except LineFailure as error:
            failure = error
            return False
        return _plausible(registers, first.address, words(answer))

    if await answers(_NEW):
        return _NEW
    may_be_new = failure is not None
    if await answers(_OLD):
        return _NEW if may_be_new and await answers(_NEW) else _OLD
    if refusal is None and failure is not None:
        raise failure
    raise NoMic488(NO_MIC488(place=line.place, unit=unit, why=IMPLAUSIBLE() if refusal is None else text_of(refusal)))


def _plausible(registers: RegisterMap, start: int, content: tuple[int, ...]) -> bool:
    """Whether enumerated registers hold one of their values."""
    for register in registers:
        if register.address < start or register.last >= start + len(content) or not register.reads:
            continue
        word = content[register.address - start]
        if register.values and word not in register.values:
            return False
    return True


async def scan(
    line: DriverLine[ModbusQuery, bytes],
    units: Iterable[int],
    *,
    timeout_ns: Nanos = SCAN_NS,
    progress: Callable[[int], Any] | None = None,
) -> list[FoundUnit]:
    """The units that respond on a line. ``progress`` is called with every unit before it is tried. Raises `LineLost`.

    Of several units, one that answers everything with exception 04 or 06 is absent: some gateways say so.
    """
    units = list(units)
    found: list[FoundUnit] = []
    inputs = pdu.ReadRequest(pdu.READ_DISCRETE_INPUTS, 5000, 8)  # every firmware has them, and it is the manual's own example
    for unit in units:
        if progress is not None:
            progress(unit)
        is_vague = False
        try:
            await line.exchange(Job(ModbusQuery(unit, inputs), timeout_ns))
        except pdu.ModbusException as exception:
            if exception.code in _GATEWAY_CODES:
                continue
            is_vague = exception.code in _VAGUE_CODES and len(units) > 1
        except LineLost:
            raise
        except LineFailure:
            continue
        try:
            firmware = await firmware_of(line, unit, 2 * timeout_ns)
        except LineLost:
            raise
        except (Refusal, LineFailure):
            firmware = None
        if firmware is not None or not is_vague:
            found.append(FoundUnit(unit, firmware))
    if sum(one.firmware is not None for one in found) > 1 and await _answers_every_unit(line, inputs, timeout_ns):
        return [one._replace(every_unit=True) for one in found]
    return found


async def _answers_every_unit(line: DriverLine[ModbusQuery, bytes], look: pdu.ReadRequest, timeout_ns: Nanos) -> bool:
    """Whether a unit that no device has is answered; over RTU it cannot be asked."""
    if not line.shared.get("tcp"):
        return False
    try:
        await line.exchange(Job(ModbusQuery(_NO_UNIT, look), timeout_ns))
    except LineLost:
        raise
    except (Refusal, LineFailure):
        return False
    return True

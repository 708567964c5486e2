"""Who answers: the firmware by its addresses, controllers by their units, and what is none."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from host_rig import Fault, Wire, thread_line

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.drivers import LineLost, Mic488, NoAnswer, NoMic488
from steptwin.drivers.blocking import finish
from steptwin.drivers.mic488.failures import ModbusRefusal
from steptwin.drivers.mic488.identify import SCAN_NS, FoundUnit, scan
from steptwin.errors import LineFailure
from steptwin.wire import rtu


def opened(wire: Wire, **options: object) -> Mic488:
    mic = Mic488(thread_line(wire), **options)  # type: ignore[arg-type]
    mic.open()
    return mic


@pytest.mark.parametrize(("firmware", "found"), [("1.23", "1.23"), ("1.40", "1.70"), ("1.70", "1.70")])
def test_the_firmware_is_found_by_its_addresses(firmware: str, found: str) -> None:
    """1.40 has the addresses of 1.70, and no read tells them apart."""
    assert opened(Wire(firmware=firmware)).firmware == found


def test_the_firmware_may_be_given() -> None:
    wire = Wire(firmware="1.40")
    mic = opened(wire, firmware="1.40")
    assert mic.firmware == "1.40"
    assert len(wire.sent) == 1


def answering(wire: Wire, answer: Callable[[bytes], bytes | None]) -> None:
    """Somebody else is at the other end of the wire."""
    wire.severed = True

    def reply(frame: bytes) -> None:
        pdu = answer(frame[1:-2])
        if pdu is not None:
            wire.inject(rtu.encode_frame(frame[0], pdu), after=wire.latency)

    wire.before_each = reply


def describe_input(request: bytes, word: int) -> bytes:
    count = struct.unpack(">H", request[3:5])[0]
    return bytes((3, 2 * count)) + word.to_bytes(2, "big") * count


def test_silent_where_another_refuses_is_found_too() -> None:
    """A real controller may not answer at addresses it does not have."""
    wire = Wire()
    answering(wire, lambda request: describe_input(request, 0) if request[1:3] < (2000).to_bytes(2, "big") else None)
    mic = Mic488(thread_line(wire))
    mic.open()
    assert mic.firmware == "1.23"


@pytest.mark.parametrize(
    "faults", [(Fault("to twin", 5, "cut"), Fault("to twin", 13, "cut")), (Fault("to twin", 5, "much too late"),)]
)
def test_an_answer_that_is_lost_makes_no_older_controller(faults: tuple[Fault, ...]) -> None:
    """User registers lie where 1.23 has its axes: both tries at the addresses of 1.70 fail, all else is answered."""
    wire = Wire()
    wire.put(*(replace(fault) for fault in faults))
    mic = opened(wire)
    assert mic.firmware == "1.70"
    assert mic.axis(1).position() == 0.0


def test_somebody_else_is_named() -> None:
    wire = Wire()
    answering(wire, lambda request: describe_input(request, 0x7777))
    with pytest.raises(NoMic488, match=r"unit 1 responds, but does not have the registers of a MIC488 \(implausible values\)"):
        opened(wire)
    wire = Wire()
    answering(wire, lambda request: bytes((request[0] | 0x80, 1)))
    with pytest.raises(NoMic488, match="the controller does not have this function"):
        opened(wire)


@pytest.mark.parametrize("address", [10_000, 10_013])
def test_one_value_that_a_mic488_cannot_have_is_enough(address: int) -> None:
    """DATA_TYPE and M4_STATUS, the first and the last of the registers that are read."""
    wire = Wire()

    def answer(request: bytes) -> bytes:
        first, count = struct.unpack(">HH", request[1:5])
        if first != 10_000:
            return bytes((request[0] | 0x80, 2))
        return bytes((3, 2 * count)) + b"".join((99 * (first + n == address)).to_bytes(2, "big") for n in range(count))

    answering(wire, answer)
    with pytest.raises(NoMic488):
        opened(wire)


def test_nobody_is_not_waited_for_long() -> None:
    wire = Wire()
    wire.severed = True
    begin = wire.now
    with pytest.raises(NoAnswer, match="read the control registers of firmware"):
        opened(wire)
    assert wire.now - begin < 2 * SECOND


def test_scanning_finds_who_is_there() -> None:
    wire = Wire(units=(2, 5), firmware="1.23")
    asked: list[int] = []
    begin = wire.now
    assert finish(scan(thread_line(wire), range(1, 9), progress=asked.append)) == [FoundUnit(2, "1.23"), FoundUnit(5, "1.23")]
    assert asked == list(range(1, 9))
    assert wire.sent[0][1][:-2].hex() == "010213880008"
    assert wire.now - begin < 8 * (SCAN_NS + SECOND // 10)


def test_scanning_tells_who_is_no_mic488() -> None:
    wire = Wire()
    answering(wire, lambda request: bytes((request[0] | 0x80, 1)))
    assert finish(scan(thread_line(wire), [7])) == [FoundUnit(7, None)]


@pytest.mark.parametrize("code", [4, 6])
def test_a_gateway_that_reports_absent_units_as_failed_or_busy(code: int) -> None:
    """A unit that was asked for alone is named nevertheless, and a controller that is busy once is found."""
    wire = Wire()
    answering(wire, lambda request: bytes((request[0] | 0x80, code)))
    assert finish(scan(thread_line(wire), [7, 8])) == []
    assert finish(scan(thread_line(wire), [7])) == [FoundUnit(7, None)]
    answering(wire, lambda request: bytes((0x82, code)) if request[0] == 2 else bytes((3, 28, *bytes(28))))
    assert finish(scan(thread_line(wire), [7, 8])) == [FoundUnit(7, "1.70"), FoundUnit(8, "1.70")]


def test_a_gateway_that_ignores_the_unit() -> None:
    """Which is known by a unit that no device has; only over TCP can it be asked for."""
    for every in (True, False):
        wire = Wire(tcp=True, units=(1, 2))

        def passed_on(frame: bytes, wire: Wire = wire, every: bool = every) -> None:
            if frame[6] == 248 and every:
                wire.inject(frame[:4] + b"\x00\x04\xf8\x02\x01\x00", after=wire.latency)

        wire.before_each = passed_on
        line = thread_line(wire)
        line.shared["tcp"] = True
        assert finish(scan(line, [1, 2, 3])) == [FoundUnit(1, "1.70", every), FoundUnit(2, "1.70", every)]
        assert finish(scan(line, [1])) == [FoundUnit(1, "1.70")]


def test_scanning_a_port_that_is_gone_ends() -> None:
    wire = Wire()
    line = thread_line(wire)
    wire.gone = "unplugged"
    with pytest.raises(LineFailure, match="unplugged"):
        finish(scan(line, [1, 2]))


@pytest.mark.parametrize("code", [0x0A, 0x0B])
def test_a_gateway_that_reaches_nobody_is_not_asked_for_other_addresses(code: int) -> None:
    wire = Wire()
    answering(wire, lambda request: bytes((request[0] | 0x80, code)))
    with pytest.raises(ModbusRefusal, match=f"exception {code:02X}"):
        opened(wire)
    assert len(wire.sent) == 1


@pytest.mark.parametrize(("answers", "units", "time_outs"), [(False, range(1, 4), 3), (True, (1,), 4 * 2)])
def test_a_search_waits_once_for_each_unit_and_twice_as_long_for_what_one_that_is_there_does_not_say(
    answers: bool, units: Sequence[int], time_outs: int
) -> None:
    """Two firmwares are tried twice."""

    def took(timeout_ns: Nanos) -> Nanos:
        wire = Wire()
        answering(wire, lambda request: b"\x02\x01\x00" if answers and request[0] == 2 else None)
        line = thread_line(wire)
        finish(line.open())
        begin = line.now()
        assert finish(scan(line, units, timeout_ns=timeout_ns)) == ([FoundUnit(1, None)] if answers else [])
        return line.now() - begin

    assert took(90 * MILLISECOND) - took(50 * MILLISECOND) == time_outs * 40 * MILLISECOND


def test_a_line_that_is_lost_ends_the_search() -> None:
    """No other unit can answer on it either."""
    tried: list[int] = []
    wire = Wire()
    wire.gone = "unplugged"
    with pytest.raises(LineLost, match="unplugged"):
        finish(scan(thread_line(wire), range(1, 9), progress=tried.append))
    assert tried == [1]


@pytest.mark.parametrize("sent", [2, 3, 4])
def test_a_line_that_is_lost_while_the_firmware_is_found_out(sent: int) -> None:
    """Neither is a missing answer taken for another firmware, nor the unit for something else."""
    wire = Wire(firmware="1.23")
    line = thread_line(wire)
    finish(line.open())

    def lose(_: bytes) -> None:
        if len(wire.sent) == sent - 1:
            wire.gone = "unplugged"

    wire.before_each = lose
    if sent > 3:
        assert finish(scan(line, [1])) == [FoundUnit(1, "1.23")]
        return
    with pytest.raises(LineLost, match="unplugged"):
        finish(scan(line, [1]))
    wire.gone = None


@pytest.mark.parametrize("code", [10, 11])
def test_a_gateway_that_finds_nobody_is_nobody(code: int) -> None:
    wire = Wire()
    answering(wire, lambda request: bytes((request[0] | 0x80, code)))
    assert finish(scan(thread_line(wire), [1, 2])) == []
    answering(wire, lambda request: bytes((request[0] | 0x80, 12)))
    assert finish(scan(thread_line(wire), [1, 2])) == [FoundUnit(1, None), FoundUnit(2, None)]

"""The checks of the MIC488. The facts are those of docs/assumptions.md under the same id."""

from __future__ import annotations

import struct

from steptwin.drivers.mic488.motion import MOVING
from steptwin.mic488.encoding import real_to_words, words_to_real
from steptwin.mic488.registers import AXES
from steptwin.mic488.status import AxisStatus
from steptwin.verify.check import Check, CheckNeed, CheckRequest, CheckSteps, Undecided
from steptwin.verify.modbus import ModbusTalk, read, write, write_one
from steptwin.wire import pdu, rtu
from steptwin.wire.crc import with_crc

INPUTS = 5000
LAST_BANK = {"1.23": 7, "1.40": 7, "1.70": 5}
NOWHERE = 0xFFF0
"""An address that no firmware has."""
QUICK = 40
"""Requests in immediate succession; at 38400 bit/s one takes 5 ms."""
SETTLE_S = 0.3
LONGEST_MOVE_S = 10.0
FUNCTION, ADDRESS, VALUE = pdu.ILLEGAL_FUNCTION, pdu.ILLEGAL_DATA_ADDRESS, pdu.ILLEGAL_DATA_VALUE


def _serial_only(talk: ModbusTalk) -> str | None:
    return "Modbus TCP has neither CRC nor gaps: connect to the serial line" if talk.framed else None


def _tcp_only(talk: ModbusTalk) -> str | None:
    return None if talk.framed else "needs Modbus TCP"


# ---------------------------------------------------------------------- reads, and writes that are to be refused


def _refusals(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.expect_refusal("function 07, which it does not have", b"\x07", FUNCTION)
    yield from talk.expect_refusal(f"read of register {NOWHERE}", read(NOWHERE, 1), ADDRESS)
    yield from talk.expect_refusal("read of no register", read(talk.at("DATA_TYPE"), 0), VALUE)
    if talk.framed:
        return
    good = rtu.encode_frame(talk.unit, read(talk.at("DATA_TYPE"), 1))
    other = rtu.MAX_UNIT if talk.unit != rtu.MAX_UNIT else 1
    yield from talk.expect_silence("read with a wrong CRC", good[:-1] + bytes((good[-1] ^ 0xFF,)))
    yield from talk.expect_silence("a frame without a function code", with_crc(bytes((talk.unit,))))
    yield from talk.expect_silence(f"read addressed to unit {other}", rtu.encode_frame(other, good[1:-2]))
    yield from talk.expect_answer("the same read, right", good[1:-2])


def _broadcast_read(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.expect_silence("read addressed to unit 0", rtu.encode_frame(rtu.BROADCAST, read(talk.at("DATA_TYPE"), 1)))


def _holes(talk: ModbusTalk) -> CheckSteps[None]:
    used = {address for register in talk.registers for address in range(register.address, register.last + 1)}
    first = talk.at("DATA_TYPE")
    hole = next(address for address in range(first, first + 1000) if address not in used)
    yield from talk.expect_refusal(f"read of register {hole}, which is none", read(hole, 1), ADDRESS)
    yield from talk.expect_refusal("read of M_STOP, which is write-only", read(talk.at("M_STOP"), 1), ADDRESS)
    last = talk.at("STATUS", AXES)
    yield from talk.expect_refusal("read of M4_STATUS and the write-only register after it", read(last, 2), ADDRESS)


def _halves(talk: ModbusTalk) -> CheckSteps[None]:
    address = talk.at("ACC", 1)
    both = yield from talk.words(address, 2)
    for name, offset in (("first", 0), ("second", 1)):
        (word,) = yield from talk.words(address + offset, 1)
        talk.probes.equal(f"{name} word of M1_ACC alone", f"{both[offset]:04X}", f"{word:04X}")
    (program,) = yield from talk.words(talk.at("PROGRAM_CTRL"), 1)
    if program:
        return  # it could change the value meanwhile
    # A controller that takes one word for a whole value, as it does for JOG_SPEED (MIC-6), would change the value.
    before = yield from talk.remember("M1_ACC", address, 2)
    yield from talk.expect_refusal("its first word written as it is, function 06", write_one(address, before[0]), ADDRESS)
    yield from talk.keep("M1_ACC", address, before)
    before = yield from talk.remember("M1_ACC", address, 2)
    yield from talk.expect_refusal("its second word written as it is, function 16", write(address + 1, before[1]), ADDRESS)
    yield from talk.keep("M1_ACC", address, before)


def _after_noise(talk: ModbusTalk) -> CheckSteps[None]:
    request = rtu.encode_frame(talk.unit, read(talk.at("DATA_TYPE"), 1))
    yield CheckRequest(b"\xff\x00\xff", 0.1)
    yield from talk.expect_answer("a request 0.1 s behind noise", request[1:-2])
    yield CheckRequest(request[:4], 0.1)
    torn = yield from talk.raw(request[4:], at_once=True)
    came = "answered" if torn.pdu else "dropped"
    talk.probes.holds("a request with a pause of 0.1 s in it", "dropped, or answered because of a slow adapter", came, True)
    yield CheckRequest(b"", 2.5)
    yield from talk.expect_answer("the next request", request[1:-2])


def _program_state(talk: ModbusTalk) -> CheckSteps[None]:
    (state,) = yield from talk.words(talk.at("PROGRAM_CTRL"), 1)
    talk.probes.holds("PROGRAM_CTRL", "0, 1 or 2", str(state), state in (0, 1, 2))


def _tcp_units(talk: ModbusTalk) -> CheckSteps[None]:
    request = read(talk.at("DATA_TYPE"), 1)
    for unit in (0, 255):
        yield from talk.expect_answer(f"read addressed to unit {unit}", request, unit=unit)


def _quantities(talk: ModbusTalk) -> CheckSteps[None]:
    first = talk.at("DATA_TYPE")
    user = talk.at("USER_REGISTER")
    yield from talk.expect_answer("read of 125 registers", read(user, pdu.MAX_REGISTERS))
    for count in (0, pdu.MAX_REGISTERS + 1):
        yield from talk.expect_refusal(f"read of {count} registers", read(user, count), VALUE)
    for count in (0, pdu.MAX_BITS + 1):
        yield from talk.expect_refusal(f"read of {count} inputs", read(INPUTS, count, pdu.READ_DISCRETE_INPUTS), VALUE)
    status = talk.at("STATUS", 1)
    (present,) = yield from talk.words(status, 1)
    yield from talk.expect_refusal("M1_STATUS, which is read-only, written as it is", write_one(status, present), ADDRESS)
    yield from talk.expect_refusal("the same with function 16", write(status, present), ADDRESS)
    wrong = struct.pack(">BHHBH", pdu.WRITE_MULTIPLE_REGISTERS, status, 1, 4, present)
    yield from talk.expect_refusal("the same with a byte count of 4", wrong, VALUE)
    yield from talk.expect_answer("read of one register", read(first, 1))


def _in_succession(talk: ModbusTalk) -> CheckSteps[None]:
    answered = 0
    for _ in range(QUICK):
        answer = yield from talk.ask(read(INPUTS, 8, pdu.READ_DISCRETE_INPUTS), at_once=True)
        answered += bool(answer.pdu) and answer.refusal is None
    talk.probes.equal(f"answers to {QUICK} reads in immediate succession", QUICK, answered)


# ---------------------------------------------------------------------- writes that are put back


def _several_registers(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    address = talk.at("DATA_TYPE")
    before = yield from talk.remember("DATA_TYPE and PROG_BANK_SEL", address, 2)
    yield from talk.expect_answer("function 16 to DATA_TYPE alone, as it is", write(address, before[0]))
    yield from talk.expect_answer("DATA_TYPE and PROG_BANK_SEL in one request, as they are", write(address, *before))
    other = 1 - before[0] if before[0] in (0, 1) else 0
    yield from talk.expect_refusal("another DATA_TYPE with a bank that does not exist", write(address, other, 99), VALUE)
    after = yield from talk.words(address, 2)
    talk.probes.equal("both afterwards", before, after)
    yield from _back_one_by_one(talk, "DATA_TYPE and PROG_BANK_SEL", address, before)


def _back_one_by_one(talk: ModbusTalk, name: str, address: int, before: tuple[int, ...]) -> CheckSteps[None]:
    """For registers of one word, of which a controller might not take several in one request."""
    for offset, word in enumerate(before):
        yield from talk.ask(write_one(address + offset, word))
    if (yield from talk.words(address, len(before))) == before:
        del talk.probes.unrestored[name]
    else:
        yield from talk.put_back(name, address, before)


def _bad_values(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    (data_type,) = yield from talk.remember("DATA_TYPE", talk.at("DATA_TYPE"), 1)
    yield from talk.expect_refusal("DATA_TYPE = 2", write_one(talk.at("DATA_TYPE"), 2), VALUE)
    yield from talk.put_back("DATA_TYPE", talk.at("DATA_TYPE"), (data_type,))
    address = talk.at("ACC", 1)
    before = yield from talk.remember("M1_ACC", address, 2)
    bad = {"0": (0, 0)}
    if data_type == 0:
        bad |= {text: real_to_words(float(text)) for text in ("-1", "nan", "inf")}
    for text, words in bad.items():
        yield from talk.expect_refusal(f"M1_ACC = {text}", write(address, *words), VALUE)
    talk.probes.equal("M1_ACC afterwards", before, (yield from talk.words(address, 2)))
    yield from talk.put_back("M1_ACC", address, before)


def _in_both_types(talk: ModbusTalk, *keys: str) -> CheckSteps[list[tuple[float, int]]]:
    """Parameters of M1 with DATA_TYPE 0 (units) and 1 (pulses)."""
    address = talk.at("DATA_TYPE")
    (before,) = yield from talk.remember("DATA_TYPE", address, 1)
    yield from talk.ask(write_one(address, 0))
    real = []
    for key in keys:
        words = yield from talk.words(talk.at(key, 1), 2)
        real.append(words_to_real(*words))
    yield from talk.ask(write_one(address, 1))
    whole = []
    for key in keys:
        low, high = yield from talk.words(talk.at(key, 1), 2)
        whole.append(low | high << 16)
    yield from talk.put_back("DATA_TYPE", address, (before,))
    found = list(zip(real, whole, strict=True))
    if not all(units > 0.0 and pulses > 0 for units, pulses in found):
        raise Undecided(f"needs {' and '.join(f'M1_{key}' for key in keys)} above 0")
    return found


def _data_type(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    (acc_u, acc), (vmax_u, vmax) = yield from _in_both_types(talk, "ACC", "VMAX")
    # GEAR, the pulses per unit, cannot be read; it is the same for all parameters of the axis. Both are rounded to whole pulses.
    gear = vmax / vmax_u
    expected = f"{acc_u * gear:g}, as M1_VMAX is {vmax_u:g} and {vmax}"
    is_right = abs(acc - acc_u * gear) <= 1 + acc_u / vmax_u
    talk.probes.holds(f"M1_ACC, {acc_u:g} with DATA_TYPE 0, with DATA_TYPE 1", expected, str(acc), is_right)


def _mask_bits(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    before = yield from talk.words(talk.at("STATUS", 1), AXES)
    yield from talk.expect_answer("M_STOP = 00F0 hex", write_one(talk.at("M_STOP"), 0xF0))
    talk.probes.equal("status of the axes afterwards", before, (yield from talk.words(talk.at("STATUS", 1), AXES)))


def _banks(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    for key in ("PROG_BANK_SEL", "POS_BANK_SEL"):
        address = talk.at(key)
        before = yield from talk.remember(key, address, 1)
        highest = LAST_BANK[talk.firmware]
        if talk.may_be_older and (yield from talk.ask(write_one(address, highest + 1))).refusal is None:
            highest = LAST_BANK["1.40"]
        yield from talk.expect_answer(f"{key} = {highest}", write_one(address, highest))
        yield from talk.expect_refusal(f"{key} = {highest + 1}", write_one(address, highest + 1), VALUE)
        yield from talk.put_back(key, address, before)


def _small_values(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    address, acc = talk.at("DATA_TYPE"), talk.at("ACC", 1)
    (data_type,) = yield from talk.words(address, 1)
    if data_type != 0:
        raise Undecided("needs DATA_TYPE 0, so that the value can be put back exactly")
    ((acc_u, pulses),) = yield from _in_both_types(talk, "ACC")
    (before,) = yield from talk.remember("DATA_TYPE", address, 1)
    value = yield from talk.remember("M1_ACC", acc, 2)
    half = 0.5 * acc_u / pulses
    yield from talk.expect_answer(f"M1_ACC = {half:g}, half a pulse", write(acc, *real_to_words(half)))
    yield from talk.ask(write_one(address, 1))
    low, high = yield from talk.words(acc, 2)
    yield from talk.put_back("DATA_TYPE", address, (before,))
    yield from talk.put_back("M1_ACC", acc, value)
    talk.probes.equal("it reads with DATA_TYPE 1", 1, low | high << 16)


# ---------------------------------------------------------------------- motions


def _status(talk: ModbusTalk) -> CheckSteps[int]:
    (status,) = yield from talk.words(talk.at("STATUS", talk.axis), 1)
    return status


def _move_by(talk: ModbusTalk) -> bytes:
    return write(talk.at("POS_REL", talk.axis), *real_to_words(talk.distance_u))


def _needs_real(talk: ModbusTalk) -> CheckSteps[None]:
    yield from talk.at_rest()
    (data_type,) = yield from talk.words(talk.at("DATA_TYPE"), 1)
    (mode,) = yield from talk.words(talk.at("AXIS_CTR_MODE"), 1)
    if data_type or mode:
        raise Undecided("needs DATA_TYPE 0 and AXIS_CTR_MODE 0")


def _move_while_off(talk: ModbusTalk) -> CheckSteps[None]:
    yield from _needs_real(talk)
    if (yield from _status(talk)) != AxisStatus.OFF:
        raise Undecided(f"needs M{talk.axis} disabled")
    position = talk.at("POS_ACT", talk.axis)
    before = yield from talk.words(position, 2)
    yield from talk.expect_answer(f"M{talk.axis} by {talk.distance_u:g} units while it is off", _move_by(talk))
    yield CheckRequest(b"", SETTLE_S)
    talk.probes.equal("status", 0, (yield from _status(talk)))
    talk.probes.equal("position", before, (yield from talk.words(position, 2)))


def _stop_without_ramp(talk: ModbusTalk) -> CheckSteps[None]:
    yield from _needs_real(talk)
    if (yield from _status(talk)) == AxisStatus.OFF:
        raise Undecided(f"needs M{talk.axis} enabled")
    position = talk.at("POS_ACT", talk.axis)
    before = yield from talk.remember(f"M{talk.axis}_POS_ACT", position, 2)
    yield from talk.ask(_move_by(talk))
    moving = yield from _status(talk)
    yield from talk.ask(write_one(talk.at("M_STOP"), 1 << talk.axis - 1))
    status = yield from _status(talk)
    first = yield from talk.words(position, 2)
    yield CheckRequest(b"", SETTLE_S)
    second = yield from talk.words(position, 2)
    yield from talk.ask(write(talk.at("POS_ABS", talk.axis), *before))
    waited_s = 0.0
    while (yield from _status(talk)) in MOVING and waited_s < LONGEST_MOVE_S:
        yield CheckRequest(b"", SETTLE_S)
        waited_s += SETTLE_S
    del talk.probes.unrestored[f"M{talk.axis}_POS_ACT"]
    if moving not in MOVING:
        raise Undecided(f"the motion by {talk.distance_u:g} units was over before it could be stopped: permit a longer one")
    talk.probes.equal("status after M_STOP during a motion", int(AxisStatus.ON), status)
    talk.probes.equal(f"position {SETTLE_S:g} s later", words_to_real(*first), words_to_real(*second))
    talk.probes.equal("position after the return", words_to_real(*before), words_to_real(*(yield from talk.words(position, 2))))


WRITE, MOVE = CheckNeed.WRITE, CheckNeed.MOVE
CHECKS: tuple[Check[ModbusTalk], ...] = (
    Check("MIC-1", "Unknown function, address, quantity; wrong CRC, other unit, short frame", _refusals),
    Check("MIC-2", "A read by broadcast (a write would change other controllers, too)", _broadcast_read, unless=_serial_only),
    Check("MIC-3", "Reads of holes and of write-only registers", _holes),
    Check("MIC-4", "Function 16 to registers of one word, to several, and with a bad value", _several_registers, WRITE),
    Check("MIC-5", "Half a value of 32 bits", _halves),
    Check("MIC-7", "Bad values of DATA_TYPE and M1_ACC", _bad_values, WRITE),
    Check("MIC-8", "A motion command to an axis that is off", _move_while_off, MOVE),
    Check("MIC-10", "STOP during a motion", _stop_without_ramp, MOVE),
    Check("MIC-15", "Requests behind noise and with a pause", _after_noise, unless=_serial_only),
    Check("MIC-17", "M1_ACC with both values of DATA_TYPE", _data_type, WRITE),
    Check("MIC-22", "What PROGRAM_CTRL reads", _program_state),
    Check("MIC-23", "Units 0 and 255 on Modbus TCP, of a single controller", _tcp_units, unless=_tcp_only),
    Check("MIC-24", "Impossible quantities; writes to read-only registers", _quantities),
    Check("MIC-25", "Bits of M_STOP above the fourth axis", _mask_bits, WRITE),
    Check("MIC-28", "The last bank, and the one after it", _banks, WRITE),
    Check("MIC-32", "Reads in immediate succession", _in_succession),
    Check("MIC-42", "M1_ACC of half a pulse with DATA_TYPE 1", _small_values, WRITE),
)

"""The kinds of faults of frames and of the protocol."""

from __future__ import annotations

from steptwin.messages import Message
from steptwin.simulation.faults.active import ActiveFault, FaultReporter
from steptwin.simulation.faults.answers import NEVER_SENT, AlteredAnswer, Exchange
from steptwin.simulation.faults.effects import AnswerEffect, RequestEffect
from steptwin.simulation.faults.table import (
    LONGEST_MS,
    MODBUS,
    Fault,
    FaultKind,
    Layer,
    LineProtocol,
    Occasion,
    Parameter,
    ParameterForm,
    number,
    whole,
)
from steptwin.wire.crc import with_crc
from steptwin.wire.pdu import DEVICE_BUSY

_UNITS = 248
"""Unit 247 is followed by 0."""


LATER = Message("simulation.answer-is-later", "{time:g} ms later: {bytes}")


def _delay(active: ActiveFault, exchange: Exchange, unit: int, sent: AlteredAnswer, report: FaultReporter) -> AlteredAnswer:
    report(active, LATER(time=active.fault.number("for_ms"), bytes=sent.answer.hex(" ")))
    return sent._replace(delay=sent.delay + active.ns("for_ms"))


def _is_request_lost(fault: Fault) -> bool:
    return fault.get("lost") == "request"


REQUEST_IS_LOST = Message("simulation.request-is-lost", "request lost on its way")


def _lose_request(active: ActiveFault) -> tuple[int, str]:
    return NEVER_SENT, REQUEST_IS_LOST()


ANSWER_IS_LOST = Message("simulation.answer-is-lost", "lost on its way: {bytes}")


def _lose_answer(active: ActiveFault, exchange: Exchange, unit: int, sent: AlteredAnswer, report: FaultReporter) -> AlteredAnswer:
    report(active, ANSWER_IS_LOST(bytes=sent.answer.hex(" ")))
    return sent._replace(answer=b"")


HELD_BACK = Message("simulation.answer-is-held-back", "held back: {bytes}")


def _hold_back(active: ActiveFault, exchange: Exchange, unit: int, sent: AlteredAnswer, report: FaultReporter) -> AlteredAnswer:
    report(active, HELD_BACK(bytes=sent.answer.hex(" ")))
    return sent._replace(answer=b"", later=sent.answer)


ANSWERED_AS = Message("simulation.answered-as-unit", "answered as unit {unit}: {bytes}")


def _answer_as(active: ActiveFault, exchange: Exchange, unit: int, sent: AlteredAnswer, report: FaultReporter) -> AlteredAnswer:
    other = active.fault.whole("answers_as")
    other = (unit + 1) % _UNITS if other is None else other
    report(active, ANSWERED_AS(unit=other, bytes=sent.answer.hex(" ")))
    return sent._replace(answer=_as_unit(exchange.line, sent.answer, other))


def _as_unit(line: LineProtocol, raw: bytes, unit: int) -> bytes:
    if line is LineProtocol.RTU:
        return with_crc(bytes((unit,)) + raw[1:-2])
    return raw[:6] + bytes((unit,)) + raw[7:]


WRONG_CRC = Message("simulation.wrong-crc", "wrong CRC: {bytes}")


def _spoil_crc(active: ActiveFault, exchange: Exchange, unit: int, sent: AlteredAnswer, report: FaultReporter) -> AlteredAnswer:
    raw = sent.answer
    wrong = int.from_bytes(raw[-2:], "little") ^ 1 + active.chance.below(0xFFFF)
    raw = raw[:-2] + wrong.to_bytes(2, "little")
    report(active, WRONG_CRC(bytes=raw.hex(" ")))
    return sent._replace(answer=raw)


ECHO = Message("simulation.echo", "echo: {bytes}")


def _echo(active: ActiveFault, exchange: Exchange, unit: int, sent: AlteredAnswer, report: FaultReporter) -> AlteredAnswer:
    report(active, ECHO(bytes=exchange.request.hex(" ")))
    return sent._replace(before=exchange.request)


REFUSED = Message("simulation.refused-with-exception", "refused with exception {code:02X}")


def _refuse(active: ActiveFault) -> tuple[int, str]:
    code = active.fault.whole("code") or DEVICE_BUSY
    return code, REFUSED(code=code)


FRAMES = (
    FaultKind(
        "delay",
        Layer.FRAMES,
        Occasion.ANSWER,
        "The answer takes longer; the ones behind it wait.",
        (number("for_ms", "How much longer.", 1e-3, LONGEST_MS, default=500.0),),
        MODBUS,
        effect=AnswerEffect(_delay),
    ),
    FaultKind(
        "no-answer",
        Layer.FRAMES,
        Occasion.REQUEST,
        "There is no answer: the request was lost on its way, or was carried out and the answer lost.",
        (Parameter("lost", ParameterForm.WORD, "What was lost.", words=("answer", "request"), default="answer"),),
        MODBUS,
        effect=RequestEffect(_lose_request, _is_request_lost, _lose_answer),
        tried=({"lost": "answer"}, {"lost": "request"}),
    ),
    FaultKind(
        "late",
        Layer.FRAMES,
        Occasion.ANSWER,
        "The answer is held back and comes before the next one.",
        (),
        MODBUS,
        effect=AnswerEffect(_hold_back),
    ),
    FaultKind(
        "wrong-unit",
        Layer.FRAMES,
        Occasion.ANSWER,
        "The answer carries the address of another unit.",
        (whole("answers_as", "Which.", 0, 255, otherwise="the next one"),),
        MODBUS,
        effect=AnswerEffect(_answer_as),
    ),
    FaultKind(
        "crc",
        Layer.FRAMES,
        Occasion.ANSWER,
        "The answer has a wrong CRC.",
        (),
        (LineProtocol.RTU,),
        effect=AnswerEffect(_spoil_crc),
    ),
    FaultKind(
        "echo",
        Layer.FRAMES,
        Occasion.ANSWER,
        "The request comes back before its answer.",
        (),
        (LineProtocol.RTU,),
        effect=AnswerEffect(_echo),
    ),
    FaultKind(
        "exception",
        Layer.PROTOCOL,
        Occasion.REQUEST,
        "The request is refused and not carried out.",
        (whole("code", "The exception code.", 1, 255, default=4),),
        MODBUS,
        effect=RequestEffect(_refuse),
    ),
    FaultKind(
        "busy",
        Layer.PROTOCOL,
        Occasion.REQUEST,
        "The request is refused with exception 6, device busy, and not carried out.",
        (),
        MODBUS,
        effect=RequestEffect(_refuse),
    ),
)

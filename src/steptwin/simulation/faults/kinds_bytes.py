"""The kinds of faults of bytes."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.messages import Message
from steptwin.simulation.faults.active import ActiveFault, FaultReporter
from steptwin.simulation.faults.effects import ByteEffect, InsertEffect, Run, SplitEffect
from steptwin.simulation.faults.table import ALL_LINES, LONGEST_MS, SERIAL, FaultKind, Layer, Occasion, number, whole

BECOMES = Message("simulation.byte-becomes", "{byte:02X} becomes {turned:02X}")


def _flip(active: ActiveFault, byte: int, run: Run, report: FaultReporter) -> int:
    bit = active.fault.whole("bit")
    turned = byte ^ 1 << (active.chance.below(8) if bit is None else bit)
    report(active, BECOMES(byte=byte, turned=turned))
    return turned


IS_LOST = Message("simulation.byte-is-lost", "{byte:02X} is lost")
SEVERAL_ARE_LOST = Message("simulation.bytes-are-lost", "{byte:02X} is lost and {more} more")


def _drop(active: ActiveFault, byte: int, run: Run, report: FaultReporter) -> None:
    active.left = int(active.fault.number("length")) - 1
    report(active, SEVERAL_ARE_LOST(byte=byte, more=active.left) if active.left else IS_LOST(byte=byte))


COMES_BEFORE = Message("simulation.byte-comes-before", "{byte:02X} comes before it")


def _insert(active: ActiveFault, byte: int, run: Run, report: FaultReporter) -> int:
    value = active.fault.whole("value")
    extra = active.chance.below(256) if value is None else value
    report(active, COMES_BEFORE(byte=extra))
    run.put((extra,))
    return byte


SILENCE = Message("simulation.silence-before", "{time:g} ms of silence before it")


def _gap(active: ActiveFault, byte: int, run: Run, report: FaultReporter) -> int:
    report(active, SILENCE(time=active.fault.number("for_ms")))
    run.pause(active.ns("for_ms"))
    return byte


IN_PIECES = Message("simulation.bytes-in-pieces", "{count} bytes in pieces of {length}")


def _split(active: ActiveFault, run: Run, count: int, report: FaultReporter) -> list[tuple[Nanos, bytes]]:
    length = int(active.fault.number("length"))
    report(active, IN_PIECES(count=count, length=length))
    pause = active.ns("for_ms")
    pieces: list[tuple[Nanos, bytes]] = []
    for delay, piece in run.pieces:
        for start in range(0, len(piece), length):
            pieces.append((delay + pause * len(pieces), bytes(piece[start : start + length])))
    return pieces


NOISE = Message("simulation.bytes-of-noise", "{count} bytes of noise: {bytes}")


def _noise(active: ActiveFault, run: Run, report: FaultReporter) -> None:
    noise = active.chance.some_bytes(int(active.fault.number("length")))
    report(active, NOISE(count=len(noise), bytes=noise.hex(" ")))
    run.put(noise)


BYTES = (
    FaultKind(
        "flip",
        Layer.BYTES,
        Occasion.BYTE,
        "A bit of a byte arrives turned round.",
        (whole("bit", "Which bit, 0 is the lowest.", 0, 7, otherwise="any"),),
        SERIAL,
        effect=ByteEffect(_flip),
    ),
    FaultKind(
        "drop",
        Layer.BYTES,
        Occasion.BYTE,
        "Bytes are lost.",
        (whole("length", "How many.", 1, 10_000, default=1),),
        SERIAL,
        effect=ByteEffect(_drop),
    ),
    FaultKind(
        "insert",
        Layer.BYTES,
        Occasion.BYTE,
        "A byte too much comes before a byte.",
        (whole("value", "Which.", 0, 255, otherwise="any"),),
        SERIAL,
        effect=ByteEffect(_insert),
    ),
    FaultKind(
        "gap",
        Layer.BYTES,
        Occasion.BYTE,
        "The line is silent before a byte.",
        (number("for_ms", "How long.", 1e-3, LONGEST_MS, default=30.0),),
        ALL_LINES,
        effect=ByteEffect(_gap),
    ),
    FaultKind(
        "split",
        Layer.BYTES,
        Occasion.DELIVERY,
        "Bytes come in pieces, as USB adapters deliver them.",
        (
            whole("length", "Bytes in a piece.", 1, 10_000, default=1),
            number("for_ms", "How long after each other pieces come.", 1e-3, LONGEST_MS, default=1.0),
        ),
        ALL_LINES,
        effect=SplitEffect(_split),
    ),
    FaultKind(
        "noise",
        Layer.BYTES,
        Occasion.DELIVERY,
        "Bytes of no meaning come before what was sent.",
        (whole("length", "How many.", 1, 10_000, default=8),),
        SERIAL,
        effect=InsertEffect(_noise),
    ),
)

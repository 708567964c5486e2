"""Faults of bytes on the line."""

from __future__ import annotations

from collections.abc import Sequence

from steptwin.controller import Nanos
from steptwin.messages import Message, text_of
from steptwin.simulation.faults.active import ActiveFault, FaultReporter
from steptwin.simulation.faults.effects import ByteEffect, InsertEffect, Run, SplitEffect

BYTE_OF = Message("simulation.byte-of", "byte {place} of {count}: {what}")


def spoil(data: bytes, actives: Sequence[ActiveFault], now: Nanos, report: FaultReporter) -> list[tuple[Nanos, bytes]]:
    """The pieces that ``data`` arrives in, each with its delay; faults of the order in which they were set."""
    run = Run()
    bytewise = []
    for active in actives:
        effect = active.fault.kind.effect
        if isinstance(effect, ByteEffect):
            bytewise.append(active)
        elif isinstance(effect, InsertEffect) and active.strikes(now):
            effect.act(active, run, report)
    if bytewise:
        for index, byte in enumerate(data):
            _pass(
                run,
                byte,
                bytewise,
                now,
                lambda active, what, at=index: report(active, BYTE_OF(place=at + 1, count=len(data), what=text_of(what))),
            )
    else:
        run.put(data)
    for active in actives:
        effect = active.fault.kind.effect
        if isinstance(effect, SplitEffect) and active.strikes(now):
            return effect.act(active, run, len(data), report)
    return [(delay, bytes(piece)) for delay, piece in run.pieces if piece]


def _pass(run: Run, byte: int, actives: Sequence[ActiveFault], now: Nanos, report: FaultReporter) -> None:
    lost = False
    for active in actives:
        if active.left:
            active.left -= 1
            lost = True
        elif active.strikes(now):
            arrives = active.fault.kind.effect.act(active, byte, run, report)
            if arrives is None:
                lost = True
            else:
                byte = arrives
    if not lost:
        run.put((byte,))

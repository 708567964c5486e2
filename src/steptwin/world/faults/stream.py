"""Faults of bytes: what becomes of a run of bytes on its way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from steptwin.machine import Nanos
from steptwin.world.faults.active import Active

Tell = Callable[[Active, str], None]


class _Run:
    """What arrives: pieces, each with how much later than it would have."""

    def __init__(self) -> None:
        self.pieces: list[tuple[Nanos, bytearray]] = [(0, bytearray())]

    def put(self, data: Iterable[int]) -> None:
        self.pieces[-1][1].extend(data)

    def pause(self, time: Nanos) -> None:
        self.pieces.append((self.pieces[-1][0] + time, bytearray()))


def spoil(data: bytes, actives: Sequence[Active], now: Nanos, tell: Tell) -> list[tuple[Nanos, bytes]]:
    """The pieces that ``data`` arrives in, each with its delay; faults of the order in which they were set."""
    run = _Run()
    bytewise = []
    for active in actives:
        if active.fault.kind.name == "noise":
            if active.strikes(now):
                rubbish = active.chance.some_bytes(active.fault.whole("length") or 1)
                tell(active, f"{len(rubbish)} bytes of noise: {rubbish.hex(' ')}")
                run.put(rubbish)
        elif active.fault.kind.name != "split":
            bytewise.append(active)
    if bytewise:
        for place, byte in enumerate(data):
            _pass(run, byte, bytewise, now, lambda active, what, at=place: tell(active, f"byte {at + 1} of {len(data)}: {what}"))
    else:
        run.put(data)
    for active in actives:
        if active.fault.kind.name == "split" and active.strikes(now):
            length = active.fault.whole("length") or 1
            tell(active, f"{len(data)} bytes in pieces of {length}")
            return _pieces(run, length, active.ns("for_ms"))
    return [(delay, bytes(piece)) for delay, piece in run.pieces if piece]


def _pass(run: _Run, byte: int, actives: Sequence[Active], now: Nanos, tell: Tell) -> None:
    lost = False
    for active in actives:
        fault = active.fault
        if active.left:
            active.left -= 1
            lost = True
        elif active.strikes(now):
            match fault.kind.name:
                case "flip":
                    bit = fault.whole("bit")
                    turned = byte ^ 1 << (active.chance.below(8) if bit is None else bit)
                    tell(active, f"{byte:02X} becomes {turned:02X}")
                    byte = turned
                case "drop":
                    active.left = (fault.whole("length") or 1) - 1
                    tell(active, f"{byte:02X} is lost" + (f" and {active.left} more" if active.left else ""))
                    lost = True
                case "insert":
                    value = fault.whole("value")
                    extra = active.chance.below(256) if value is None else value
                    tell(active, f"{extra:02X} comes before it")
                    run.put((extra,))
                case "gap":
                    tell(active, f"{fault.number('for_ms'):g} ms of silence before it")
                    run.pause(active.ns("for_ms"))
    if not lost:
        run.put((byte,))


def _pieces(run: _Run, length: int, pause: Nanos) -> list[tuple[Nanos, bytes]]:
    pieces: list[tuple[Nanos, bytes]] = []
    for delay, piece in run.pieces:
        for start in range(0, len(piece), length):
            pieces.append((delay + pause * len(pieces), bytes(piece[start : start + length])))
    return pieces

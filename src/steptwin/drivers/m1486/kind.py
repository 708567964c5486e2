"""What programs need of the drivers of the M1486: `M1486_DRIVER`. Positions are in full steps."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Collection, Generator, Sequence
from types import TracebackType
from typing import Any, NamedTuple

from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import LineLost
from steptwin.drivers.kind import (
    AddressSelection,
    Decoding,
    DeviceAddress,
    DeviceMotion,
    DeviceSearch,
    DriverKind,
    EndedMotion,
    FoundDevice,
    Log,
    WantedMoves,
)
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486 import named
from steptwin.drivers.m1486.conversation import ChipConversation
from steptwin.drivers.m1486.decoder import M1486Decoder
from steptwin.drivers.m1486.driver import TIMEOUT_S, AsyncM1486
from steptwin.drivers.m1486.identify import CHIP_BAUDS, SearchLine, end_line, scan_chips, select_all
from steptwin.drivers.m1486.jog import LINK_S, RELEASED
from steptwin.drivers.m1486.lines import BAUD, AsyncM1486Line
from steptwin.drivers.m1486.motion import ChipMoveEnd, ChipReason
from steptwin.drivers.m1486.sending import send
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.m1486.sync import M1486, M1486Jog
from steptwin.drivers.m1486.talk import chip_name
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.variants import DEFAULT as DEFAULT_VARIANT
from steptwin.machine import SECOND

LOST = "; the chip has counted the whole move, so its position is wrong: home the axis, or set POSITION"
"""After Kill in a move (M-16)."""
GOES_ON = "a program goes on if function 44 is ON, which is not known: --program makes sure that it has ended"
_SOUGHT = re.compile(r"([+-])B(\d{1,2})", re.IGNORECASE)


def _driver(address: DeviceAddress, log: Log | None) -> M1486:
    return M1486(address.place, address.number, baud=address.baud, variant=address.variant, timeout_s=address.timeout, log=log)


@contextlib.contextmanager
def opened(address: DeviceAddress, observe: bool, log: Log | None) -> Generator[M1486]:
    """An open driver, which leaves all settings as they are."""
    with _driver(address, log) as chip:
        yield chip


# ---------------------------------------------------------------------- as a subject, and the search


def _line(place: str, baud: int) -> DriverLine[Any, Any]:
    return AsyncM1486Line(place, baud=baud)


async def _part(address: DeviceAddress, line: DriverLine[Any, Any]) -> M1486Part:
    chip = AsyncM1486(line, address.number, variant=address.variant, timeout_s=address.timeout)
    await chip.open()
    return M1486Part(chip)


@contextlib.contextmanager
def _search_line(place: str, baud: int) -> Generator[SearchLine]:
    line = SearchLine(place, baud=baud)
    finish(line.open())
    try:
        yield line
    finally:
        finish(line.close())


def _find(
    place: str, baud: int, chips: Sequence[int], timeout_s: float, progress: Callable[[int], object]
) -> Sequence[FoundDevice]:
    with _search_line(place, baud) as line:
        try:
            found = finish(scan_chips(line, baud=baud, timeout_ns=round(timeout_s * SECOND), progress=progress))
        except LineLost:
            if "://" not in place:
                raise
            return []  # a server of Modbus TCP closes the connection when it receives characters
    return [
        FoundDevice(chip.address, chip.variant, "M1486, busy" if chip.variant is None else f"M1486{chip.variant}")
        for chip in found
    ]


def _leave(place: str, baud: int) -> None:
    """Select all chips again."""
    with contextlib.suppress(LineFailure), _search_line(place, baud) as line:
        finish(select_all(line))


def _clear(place: str, baud: int) -> None:
    for rate in (baud,) if "://" in place else dict.fromkeys((baud, BAUD)):
        with contextlib.suppress(LineFailure, Misuse), _search_line(place, rate) as line:
            finish(end_line(line))


# ---------------------------------------------------------------------- motions


def _ended(end: ChipMoveEnd) -> EndedMotion:
    target = [] if end.target is None else [f"target {end.target:g} {end.unit}"]
    return EndedMotion(
        1,
        chip_name(end.address),
        end.ok,
        end.reason.value,
        end.position,
        end.unit,
        end.after_s,
        "; ".join(filter(None, (*target, end.detail))),
        is_overdue=end.reason is ChipReason.OVERDUE,
    )


def _move(moves: WantedMoves) -> DeviceMotion[M1486]:
    ((axis, target),) = moves.targets.items()

    def begin(chip: M1486, begun: set[int], check: Callable[[], object]) -> None:
        check()
        if moves.velocity is not None:
            chip.configure(velocity=moves.velocity)
        check()
        (chip.move_by if moves.is_by else chip.move_to)(target)
        begun.add(axis)

    return DeviceMotion((axis,), begin, stop_note=LOST)


class _Sought(NamedTuple):
    """A line to seek, and the direction: 1 or -1."""

    direction: int
    line: int


def _sought(texts: Sequence[str]) -> _Sought:
    """``1=-B8``. Raises `Misuse`."""
    text = " ".join(texts)
    name, _, value = text.partition("=")
    if name.strip().upper().removeprefix("M") != "1":
        raise Misuse(f"{text!r}: an M1486 has one axis: expected 1=-B8")
    match = _SOUGHT.fullmatch(value.strip())
    if match is None:
        raise Misuse(f"{text!r}: expected the direction and the line of an M1486, such as 1=-B8 or 1=+B8")
    return _Sought(1 if match[1] == "+" else -1, int(match[2]))


def _seek(texts: Sequence[str]) -> DeviceMotion[M1486]:
    sought = _sought(texts)

    def begin(chip: M1486, begun: set[int], check: Callable[[], object]) -> None:
        check()
        chip.seek(sought.direction, sought.line)
        begun.add(1)

    return DeviceMotion((1,), begin)


def _home(texts: Sequence[str]) -> DeviceMotion[M1486]:
    """A seek, after which the position is 0."""

    def end(chip: M1486, ended: EndedMotion) -> EndedMotion:
        chip.set_position(0.0)
        return ended._replace(position=0.0)

    return DeviceMotion((1,), _seek(texts).begin, end, must_wait="the command sets the position at the end of the seek")


class _ChipJog:
    """See `steptwin.drivers.kind.DeviceHeldJog`."""

    def __init__(self, chip: M1486, velocity: float) -> None:
        self._chip = chip
        self._jog: M1486Jog = chip.jog(velocity)

    def __enter__(self) -> object:
        return self._jog.__enter__()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._jog.__exit__(kind, error, trace)

    ahead_s = 2.0 * LINK_S
    """`hold` is called during one move, and begins another."""

    @property
    def unit(self) -> str:
        return self._chip.unit

    def hold(self) -> bool:
        return self._jog.hold()

    def ended(self) -> EndedMotion:
        rest = _ended(self._chip.wait(check=False))
        end = self._jog.end
        return rest._replace(ok=rest.ok and end == RELEASED, reason=end or rest.reason)


def _wait(chip: M1486, axes: Collection[int], timeout_s: float | None) -> Sequence[EndedMotion]:
    return [_ended(chip.wait(timeout_s, check=False))]


def _stop(address: DeviceAddress, log: Log | None, axes: Collection[int], program: bool) -> str | None:
    """Stop without any preceding query: a chip does not respond while it moves. So its functions are not known."""
    chip = _driver(address, log)
    chip.open_line()
    try:
        if program:
            chip.stop_program()
            return None
        return None if chip.stop() else GOES_ON
    finally:
        chip.close()


M1486_DRIVER: DriverKind[M1486] = DriverKind(
    name="m1486",
    title="an M1486",
    axes=1,
    selection=AddressSelection(
        option="chip",
        variant="variant",
        forms="chip=0…F, variant=B",
        show=lambda address: f"{address:X}",
        read=lambda text: int(text, 16),
        may_be_open=True,
    ),
    baud=BAUD,
    timeout_s=TIMEOUT_S,
    line=_line,
    part=_part,
    search=DeviceSearch(bauds=CHIP_BAUDS, numbers=16, title="M1486 chip", form="X", find=_find, disturbs=False, leave=_leave),
    clear=_clear,
    decoding=Decoding(
        protocol="m1486",
        framed_tcp=False,
        make=lambda sink, kind, tcp: M1486Decoder(sink, DEFAULT_VARIANT.name if kind is None else kind),
    ),
    opened=opened,
    info=named.overview,
    names=lambda: named.NAMES,
    usual=named.USUAL,
    reading=named.reading,
    followed=named.followed,
    writing=named.writing,
    stop=_stop,
    move=_move,
    home=_home,
    seek=_seek,
    jog=lambda chip, axis, velocity, hold_s: _ChipJog(chip, velocity),
    wait=_wait,
    halt=lambda chip, axes: chip.stop(),
    terminal=ChipConversation,
    programs=(".m1486",),
    send=send,
)

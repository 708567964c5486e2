"""The kind of the M1486 for programs that use its drivers: `M1486_DRIVER`. Positions are in full steps."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Collection, Generator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

from steptwin.controller import SECOND
from steptwin.drivers.blocking import finish
from steptwin.drivers.exchange import LineLost
from steptwin.drivers.kind import (
    AddressSelection,
    Decoding,
    DeviceAddress,
    DeviceMotion,
    DeviceOverview,
    DeviceSearch,
    DriverKind,
    EndedMotion,
    FoundDevice,
    Log,
    Progress,
    ReadValues,
    SentProgram,
    WantedMoves,
)
from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486 import named
from steptwin.drivers.m1486.conversation import ChipConversation
from steptwin.drivers.m1486.decoder import M1486Decoder
from steptwin.drivers.m1486.download import parts
from steptwin.drivers.m1486.driver import TIMEOUT_S, AsyncM1486
from steptwin.drivers.m1486.identify import CHIP_BAUDS, SearchLine, end_line, scan_chips, select_all
from steptwin.drivers.m1486.jog import LINK_S, RELEASED
from steptwin.drivers.m1486.lines import BAUD, AsyncM1486Line
from steptwin.drivers.m1486.motion import ChipMoveEnd, ChipReason
from steptwin.drivers.m1486.subject import M1486Part
from steptwin.drivers.m1486.sync import M1486, M1486Jog, M1486Line, download_to
from steptwin.drivers.m1486.talk import chip_name
from steptwin.drivers.tcp import Endpoint
from steptwin.drivers.typed import format_value
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.microsteps import UNIT
from steptwin.m1486.syntax import parse
from steptwin.m1486.variants import DEFAULT as DEFAULT_VARIANT
from steptwin.m1486.variants import Store
from steptwin.wire.frameline import FrameLine

LOST = "; the chip has counted the whole move, so its position is wrong: home the axis, or set POSITION"
"""After Kill in a move (M-16)."""
GOES_ON = "a program goes on if function 44 is ON, which is not known: --program makes sure that it has ended"
_SOUGHT = re.compile(r"([+-])B(\d{1,2})", re.IGNORECASE)


class M1486Search(DeviceSearch):
    bauds = CHIP_BAUDS
    numbers = 16
    title = "M1486 chip"
    form = "X"
    disturbs = False

    def find(
        self, place: str, baud: int, numbers: Sequence[int], timeout_s: float, progress: Callable[[int], object]
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

    def leave(self, place: str, baud: int) -> None:
        """Select all chips again."""
        with contextlib.suppress(LineFailure), _search_line(place, baud) as line:
            finish(select_all(line))


class M1486Decoding(Decoding):
    protocol = "m1486"
    framed_tcp = False

    def make(self, sink: Callable[[FrameLine], None], variant: str | None, tcp: bool) -> M1486Decoder:
        return M1486Decoder(sink, DEFAULT_VARIANT.name if variant is None else variant)


class M1486Driver(DriverKind[M1486]):
    name = "m1486"
    title = "an M1486"
    axes = 1
    selection = AddressSelection(option="chip", variant="variant", forms="chip=0…F, variant=B", base=16, may_be_open=True)
    baud = BAUD
    timeout_s = TIMEOUT_S
    usual = ("POSITION", "VARIABLE", "FLAGS")
    search = M1486Search()
    decoding = M1486Decoding()
    programs = (".m1486",)

    def line(self, place: str | Endpoint, baud: int) -> DriverLine[Any, Any]:
        return AsyncM1486Line(place, baud=baud)

    async def part(self, address: DeviceAddress, line: DriverLine[Any, Any]) -> M1486Part:
        chip = AsyncM1486(line, address.number, variant=address.variant, timeout_s=address.timeout)
        await chip.open()
        return M1486Part(chip)

    def clear(self, place: str, baud: int) -> None:
        for rate in (baud,) if "://" in place else dict.fromkeys((baud, BAUD)):
            with contextlib.suppress(LineFailure, Misuse), _search_line(place, rate) as line:
                finish(end_line(line))

    @contextlib.contextmanager
    def opened(self, address: DeviceAddress, observe: bool, log: Log | None) -> Generator[M1486]:
        """As `DriverKind.opened`; it leaves all settings as they are."""
        with _driver(address, log) as chip:
            yield chip

    def info(self, driver: M1486, address: DeviceAddress) -> DeviceOverview:
        """As `DriverKind.info`. A type that has its program in the same memory as what is typed is only asked for its
        position."""
        names = named.NAMES if driver.variant.store is Store.EEPROM else ("POSITION", "COUNTER", "TYPE")
        found: dict[str, Any] = dict.fromkeys(named.NAMES) | {name: one.value for name, one in named.read(driver, names).items()}
        position = "unknown" if found["POSITION"] is None else f"{format_value(found['POSITION'])} {driver.unit}"
        which = "" if driver.address is None else f", chip {driver.address:X}"
        head = [f"{found['TYPE']}{which} at {driver.place}", f"position {position} ({found['COUNTER']} {UNIT})"]
        if names is named.NAMES:
            head[0] += f", {found['INTERFACE']}, series {found['SERIES']}"
            head += [
                f"internal variable {found['VARIABLE']}; flags ON: {found['FLAGS']}",
                f"functions ON: {found['FUNCTIONS']}",
            ]
        else:
            head.append(
                f"not read, because questions overwrite a program in the {driver.variant.memory_bits} bits of the command "
                "memory: "
                f"{', '.join(name.lower() for name in named.NAMES if name not in names)}; 'steptwin get NAME' reads them"
            )
        return DeviceOverview(
            {"device": driver.place, "chip": driver.address} | {name.lower(): value for name, value in found.items()}, tuple(head)
        )

    def names(self) -> Sequence[str]:
        return named.NAMES

    def reading(self, names: Sequence[str]) -> Callable[[M1486], ReadValues]:
        wanted = [name.upper() for name in names]
        for name in wanted:
            if name not in named.NAMES:
                raise Misuse(f"{name!r} is not a value of {self.title}: permitted are {', '.join(named.NAMES)}")
        return lambda chip: named.read(chip, wanted)

    def followed(self, names: Sequence[str], variant: str | None) -> Sequence[str] | None:
        """The points of a twin with these names; None if the driver knows some of them better."""
        if not names:
            return named.USUAL_POINTS
        return names if named.ONLY_OF_DRIVER.isdisjoint(name.upper() for name in names) else None

    def writing(self, changes: Sequence[str]) -> Callable[[M1486], ReadValues]:
        """As `DriverKind.writing`. Nothing is read again."""
        wanted = named.checked_changes(changes)

        def write(chip: M1486) -> ReadValues:
            for change in wanted:
                change.check(chip)
            for change in wanted:
                change.make(chip)
            return {}

        return write

    def stop(self, address: DeviceAddress, log: Log | None, axes: Collection[int], program: bool) -> str | None:
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

    def move(self, moves: WantedMoves) -> DeviceMotion[M1486]:
        ((axis, target),) = moves.targets.items()

        def begin(chip: M1486, begun: set[int], check: Callable[[], object]) -> None:
            check()
            if moves.velocity is not None:
                chip.configure(velocity=moves.velocity)
            check()
            (chip.move_by if moves.is_by else chip.move_to)(target)
            begun.add(axis)

        return DeviceMotion((axis,), begin, stop_note=LOST)

    def seek(self, texts: Sequence[str]) -> DeviceMotion[M1486]:
        sought = _sought(texts)

        def begin(chip: M1486, begun: set[int], check: Callable[[], object]) -> None:
            check()
            chip.seek(sought.direction, sought.line)
            begun.add(1)

        return DeviceMotion((1,), begin)

    def home(self, texts: Sequence[str]) -> DeviceMotion[M1486]:
        """A seek, after which the position is 0."""

        def end(chip: M1486, ended: EndedMotion) -> EndedMotion:
            chip.set_position(0.0)
            return ended._replace(position=0.0)

        return DeviceMotion((1,), self.seek(texts).begin, end, must_wait="the command sets the position at the end of the seek")

    def jog(self, driver: M1486, axis: int, velocity: float, hold_s: float) -> _ChipJog:
        return _ChipJog(driver, velocity)

    def wait(self, driver: M1486, axes: Collection[int], timeout_s: float | None) -> Sequence[EndedMotion]:
        return [_ended(driver.wait(timeout_s, check=False))]

    def halt(self, driver: M1486, axes: Collection[int]) -> None:
        driver.stop()

    def terminal(self, address: DeviceAddress, show: Callable[[str], object], log: Log | None) -> ChipConversation:
        return ChipConversation(address, show, log)

    def send(
        self, address: DeviceAddress, file: Path, text: str, progress: Progress, check: Callable[[], object], log: Log | None
    ) -> SentProgram:
        """Download a program into the chips it selects with ``X``, or into the one addressed; it runs from its ``]`` on."""
        addresses = _addressed(text, address.number, file)
        with M1486Line(address.place, baud=address.baud, log=log) as line:
            chips = {a: M1486(line, a, variant=address.variant, timeout_s=address.timeout) for a in addresses}
            for chip in chips.values():
                chip.open()
                check()
            uploaded = download_to(chips.values(), text, first=chips.get(address.number), progress=progress, name=str(file))
        title = next(iter(chips.values())).variant.title
        started = _started(text)
        names = [None if a is None else f"{a:X}" for a in addresses]
        where = f"the {title}" if len(addresses) == 1 else f"chips {', '.join(f'{a:X}' for a in addresses)} ({title})"
        return SentProgram(
            {"file": str(file), "type": title, "chips": names, "started": started is not None, "uploaded": uploaded.hex(" ")},
            f"{file} is in {where}{started or ''}" + (f"; it uploaded {uploaded.hex(' ')}" if uploaded else ""),
        )


def _driver(address: DeviceAddress, log: Log | None) -> M1486:
    return M1486(address.place, address.number, baud=address.baud, variant=address.variant, timeout_s=address.timeout, log=log)


@contextlib.contextmanager
def _search_line(place: str, baud: int) -> Generator[SearchLine]:
    line = SearchLine(place, baud=baud)
    finish(line.open())
    try:
        yield line
    finally:
        finish(line.close())


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


class _ChipJog:
    """See `steptwin.drivers.kind.DeviceDeadManJog`."""

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


def _started(text: str) -> str | None:
    """Action of a downloaded program that has already begun, as the end of a sentence; None if it cannot move the motor."""
    keys = {command.key for command in parse(text).program.commands}
    if "]" in keys:
        return " and was started by its ]: the motor may move; 'steptwin stop --program' ends it"
    return " and its commands were executed while it was sent: the motor may move" if keys & {"R", "(", ")", "J"} else None


def _addressed(text: str, chip: int | None, file: Path) -> list[int | None]:
    """The chips a program is for: those it selects with X, and ``chip`` for commands before the first X. Errors in it are
    reported later."""
    named = dict.fromkeys(chip if address is None else address for address, _ in parts(parse(text).program))
    if None in named and len(named) > 1:
        raise Misuse(f"{file} was not sent: the commands before its first X need a chip: --device ADDRESS,chip=N")
    return list(named) or [chip]


M1486_DRIVER = M1486Driver()

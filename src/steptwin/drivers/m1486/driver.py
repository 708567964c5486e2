"""The driver of the M1486 for asyncio. `steptwin.drivers.m1486.sync` is the one for threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isfinite
from types import TracebackType
from typing import Self

from steptwin.controller import SECOND
from steptwin.drivers.line import DriverLine, check_wait
from steptwin.drivers.m1486.download import DownloadProgress, begin, reset, send_program, type_file
from steptwin.drivers.m1486.failures import Busy, PositionUnknown, ProgramLost, WrongType
from steptwin.drivers.m1486.jog import AsyncM1486Jog
from steptwin.drivers.m1486.lines import BAUD, AsyncM1486Line
from steptwin.drivers.m1486.motion import UNKNOWN_S, ChipMotion, ChipMotionCommand, ChipMoveEnd, ChipMoveFailed
from steptwin.drivers.m1486.settings import COMMANDS, ChipSettings, checked_number
from steptwin.drivers.m1486.sharedstate import FUNCTION_BYTES
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.m1486.unit import PATIENCE_NS, SLICE_NS, ChipUnit
from steptwin.drivers.m1486.waiting import wait_for
from steptwin.drivers.permission import Permission
from steptwin.errors import LineFailure, Misuse
from steptwin.m1486.commands import TABLE, When, memory_bits
from steptwin.m1486.commanduse import ChipState, Control, Motion, Wait
from steptwin.m1486.functions import CARRY, FUNCTIONS, LIMITOFF, RECOVER, REPORT, RETURN, USER_FLAGS
from steptwin.m1486.lines import LINES, Interface
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.unit import MASK
from steptwin.m1486.variants import Store, Variant
from steptwin.m1486.variants import variant as variant_named
from steptwin.messages import Message

TIMEOUT_S = 0.5
LARGEST = 16_000_000
"""Farthest distance and position of F, B, G and =, in minimum microsteps."""


@dataclass(frozen=True, slots=True)
class ChipStatus:
    """Known state of a chip at rest; None: not read since the last command that may have changed it."""

    type: str
    interface: str | None
    series: int | None
    counter_u: int | None
    """The position counter, in minimum microsteps."""
    position: float | None
    unit: str
    is_position_valid: bool
    variable: int | None
    flags: dict[int, bool] | None
    functions: dict[int, bool] | None


def _flags(byte: int) -> dict[int, bool]:
    """Flags 80 to 87, as U14 sends them."""
    return {number: bool(byte >> bit & 1) for bit, number in enumerate((*USER_FLAGS, CARRY))}


WRONG_TIME_OUT = Message("drivers.m1486.wrong-time-out", "a time-out of {timeout_s:g} s is outside 0 to 60 s")
WRONG_ADDRESS = Message("drivers.m1486.wrong-address", "address {address}: permitted are 0 to 15")
WRONG_STEPS_PER_UNIT = Message("drivers.m1486.wrong-steps-per-unit", "steps_per_unit = {steps_per_unit:g}: must be above 0")
WRONG_ORIGIN = Message("drivers.m1486.wrong-origin", "origin_u = {origin_u}: permitted are 0 to {most} minimum microsteps")
OTHER_TYPE_IS_KNOWN = Message("drivers.m1486.other-type-is-known", "{place}: {name} is known as an {title}, not an {named}")
NO_POSITION = Message("drivers.m1486.no-position", "{position} {unit} is not a position")
COUNTER_SHOWS_THE_TARGET = Message(
    "drivers.m1486.counter-shows-the-target",
    "{place}: the counter of {chip} shows its target, not where it was stopped: "
    "seek a line at a known position and set that position (set_position)",
)
POSITION_IS_OUT_OF_RANGE = Message(
    "drivers.m1486.position-is-out-of-range", "position {position:g} {unit} is outside {least:g} to {most:g} {unit}"
)
OFF_THE_GRID = Message(
    "drivers.m1486.off-the-grid",
    "{value:g} {unit} is {exact:g} minimum microsteps, which is not a whole full step ({full_step}), "
    "and M of {name} is not known: configure(microstep=...) first",
)
UNKNOWN_LINE = Message("drivers.m1486.unknown-line", "no line {line}: lines are {least} to {most}")
LINE_OF_AN_INTERFACE = Message("drivers.m1486.line-of-an-interface", "B{line} belongs to the {title} interface")
UNKNOWN_FLAG = Message("drivers.m1486.unknown-flag", "no user flag {flag}: they are {least} to {most}")
UNKNOWN_FUNCTION = Message("drivers.m1486.unknown-function", "no function {function}: they are {least} to {most}")
FUNCTION_IS_OF_THE_DRIVER = Message(
    "drivers.m1486.function-is-of-the-driver", "function {function} is used by this driver: it stays {level}"
)
MARK = "u15"
"""The last command of a block: uploads the driver interface, a byte that is not a type letter."""
START_BITS = sum(map(memory_bits, ":JU"))
"""Bits that `AsyncM1486.start_program` stores: the label, the jump and the question whether it runs."""
_TYPED = frozenset(
    spec.letter.lower()
    for spec in TABLE
    if spec.when is When.QUEUED
    and (spec.use.control, spec.use.motion) == (Control.NEXT, Motion.NONE)
    and ChipState.LOOPS not in spec.use.writes
    and spec.use.waits is not Wait.SENDING
)
"""Commands that may be sent alone: they move nothing, do not jump and are not answered."""
_ONCE = frozenset(
    spec.letter.lower() for spec in TABLE if spec.use.reads & spec.use.writes & (ChipState.VARIABLE | ChipState.DISTANCE)
)
"""Commands that do something else when they are sent a second time."""
_NOT_IN_BLOCK = frozenset(
    spec.letter.lower()
    for spec in TABLE
    if spec.use.waits is Wait.SENDING or (spec.when is not When.QUEUED and spec.letter not in "@C")
)
NO_DISTANCE = Message("drivers.m1486.no-distance", "{distance} {unit} is not a distance")
DISTANCE_IS_OUT_OF_RANGE = Message(
    "drivers.m1486.distance-is-out-of-range", "distance {distance:g} {unit} is outside ±{most:g} {unit}"
)


LABEL_IS_NOT_STARTED = Message("drivers.m1486.label-is-not-started", "{place}: label {label} is not started: {why}")
CONTINUES = Message(
    "drivers.m1486.continues", "{place}: {chip} continues: function 44 is ON, LIMIT is low, or it is still braking"
)
PROGRAM_IS_NOT_STARTED = Message(
    "drivers.m1486.program-is-not-started",
    "{place}: {chip} is at rest: it has no label {label}, or its program has come to its end at once; each command that "
    "was sent has overwritten the oldest one in its memory",
)
IS_NOT_AT_REST = Message(
    "drivers.m1486.is-not-at-rest",
    "{place}: {chip} is not at rest: Kill holds it (function 51 OFF), its program continues, LIMIT is low, or it is still "
    "braking. C75 was not sent, because function 44 may be ON and the motor would move again: recover lets it go on, "
    "reset ends it",
)
END_IS_REACHED = Message(
    "drivers.m1486.end-is-reached",
    "label {label}: the end of the program can be reached from it; there the chip goes on with what was sent since, in "
    "the end with the J that starts it, again and again (M-12). End it with a loop, such as @9 W1000 J9, or run it once "
    "with download or run_block",
)


class AsyncM1486:
    """A chip at an address (``/dev/ttyUSB0``, ``tcp://host:5022``) or on a line shared with others.

    ``address``: 0 to 15, set by the pins; None for the only chip on a line. ``variant``: determined when not given; a type for
    24 MHz responds like the one for 12 MHz and has to be named. Positions are in ``unit`` of ``steps_per_unit`` full steps. The
    position counter has no sign; ``origin_u`` is its value, in minimum microsteps, at position 0.

    The driver switches function 41 (echo) on and 57 (report) off. It sends nothing before `open` (or ``async with``).
    """

    def __init__(
        self,
        where: str | DriverLine[ChipRequest, bytes],
        address: int | None = None,
        *,
        baud: int = BAUD,
        variant: str | None = None,
        steps_per_unit: float = 1.0,
        unit: str = "step",
        origin_u: int = 0,
        timeout_s: float = TIMEOUT_S,
        log: Callable[[str], object] | None = None,
    ) -> None:
        if not 0.0 < timeout_s <= 60.0:
            raise Misuse(WRONG_TIME_OUT(timeout_s=timeout_s))
        if address is not None and address not in range(16):
            raise Misuse(WRONG_ADDRESS(address=address))
        if not (isfinite(steps_per_unit) and steps_per_unit > 0.0):
            raise Misuse(WRONG_STEPS_PER_UNIT(steps_per_unit=steps_per_unit))
        if not 0 <= origin_u <= LARGEST:
            raise Misuse(WRONG_ORIGIN(origin_u=origin_u, most=LARGEST))
        self._variant = None if variant is None else variant_named(variant)
        self._own = isinstance(where, str)
        self.line: DriverLine[ChipRequest, bytes] = self._own_line(where, baud, log) if isinstance(where, str) else where
        self._unit = ChipUnit(self.line, address, timeout_ns=round(timeout_s * SECOND))
        self.unit = unit
        self.scale_u = FULL_STEP * steps_per_unit
        """Minimum microsteps per unit."""
        self.origin_u = origin_u

    def _own_line(self, address: str, baud: int, log: Callable[[str], object] | None) -> DriverLine[ChipRequest, bytes]:
        return AsyncM1486Line(address, baud=baud, log=log)

    def __repr__(self) -> str:
        return f"<AsyncM1486 {self._unit.name} on {self.line.place}>"

    @property
    def address(self) -> int | None:
        return self._unit.address

    @property
    def variant(self) -> Variant:
        """The type; known once the chip is open."""
        return self._unit.variant

    @property
    def settings(self) -> ChipSettings:
        """The settings of the chip as far as drivers on this line have made them."""
        return self._unit.shared.settings

    # ------------------------------------------------------------------ opening

    async def open(self) -> None:
        """Open the line, switch on the echo of the chip and determine its type. Without an address it also finds out whether the
        chip is the only one.

        Raises `NoEcho`, `Busy` while it moves, `SeveralChips`, `WrongType`.
        """
        await self.line.open()
        shared = self._unit.shared
        before = shared.variant
        try:
            async with self._unit.turn():
                self._take_type()
                await self._unit.look()
        except BaseException as error:
            is_known = isinstance(error, Busy) or (self._variant is not None and not isinstance(error, WrongType))
            shared.variant = before if is_known else None  # else there may be another chip now
            await self.close()
            raise

    def _take_type(self) -> None:
        """Take the type that was named. Raises `Misuse` where another one is known; one for 24 MHz answers like that for 12 MHz,
        so the clock that was named counts."""
        shared, named = self._unit.shared, self._variant
        known = shared.variant
        if named is None or named is known:
            return
        if known is not None and known.type_letter != named.type_letter:
            raise Misuse(OTHER_TYPE_IS_KNOWN(place=self.line.place, name=self._unit.name, title=known.title, named=named.title))
        shared.variant = named

    async def open_line(self) -> None:
        """Open the line only: sufficient for `stop` and `stop_program` of a moving chip, which does not respond."""
        await self.line.open()

    async def close(self) -> None:
        """Close the line, unless it is shared. The chip continues its motion and program."""
        if self._own:
            await self.line.close()

    async def __aenter__(self) -> Self:
        await self.open()
        return self

    async def __aexit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        await self.close()

    # ------------------------------------------------------------------ reading

    async def counter(self) -> int:
        """The position counter, in minimum microsteps. Raises `Busy` while the chip moves, because it does not respond then
        (M-28)."""
        async with self._unit.turn():
            return await self._unit.read_number(1)

    async def position(self) -> float:
        """The position of the motor, in ``unit``. Raises `Busy` while it moves, `PositionUnknown` after a move that was
        stopped."""
        counter = await self.counter()
        self._check_position()
        return self._in_units(counter)

    def _check_position(self) -> None:
        if not self._unit.shared.is_position_valid:
            raise PositionUnknown(COUNTER_SHOWS_THE_TARGET(place=self.line.place, chip=self._unit.name))

    def _in_units(self, counter_u: int) -> float:
        return (counter_u - self.origin_u) / self.scale_u

    def _counter_of(self, position: float) -> int:
        if not isfinite(position):
            raise Misuse(NO_POSITION(position=position, unit=self.unit))
        counter = self._on_grid(position, self.origin_u)
        if not 0 <= counter <= LARGEST:
            least, most = self._in_units(0), self._in_units(LARGEST)
            raise Misuse(POSITION_IS_OUT_OF_RANGE(position=position, unit=self.unit, least=least, most=most))
        return counter

    def _on_grid(self, value: float, offset_u: int) -> int:
        """The value in minimum microsteps, on the nearest microstep."""
        grid = self.settings.grid_u
        exact = value * self.scale_u + offset_u
        rounded = round(exact / grid) * grid
        if self.settings.microstep is None and abs(exact - rounded) > 0.5:
            raise Misuse(OFF_THE_GRID(value=value, unit=self.unit, exact=exact, full_step=FULL_STEP, name=self._unit.name))
        return rounded

    async def variable(self) -> int:
        """The internal variable, 24 bits."""
        async with self._unit.turn():
            return await self._unit.read_number(4)

    async def byte(self, number: int) -> int:
        """The byte that ``U`` with this number (1 to 20) sends. Raises `Busy` while the chip moves, waits or runs its program."""
        async with self._unit.turn():
            (byte,) = await self._unit.read(number)
        return byte

    async def flags(self) -> dict[int, bool]:
        """Flags 80 to 87."""
        async with self._unit.turn():
            (byte,) = await self._unit.read(14)
        return _flags(byte)

    async def functions(self) -> dict[int, bool]:
        """Functions 40 to 63."""
        async with self._unit.turn():
            await self._unit.read(*FUNCTION_BYTES)
        return self._functions()

    def _functions(self) -> dict[int, bool]:
        return {number: bool(self._unit.shared.function(number)) for number in FUNCTIONS}

    async def status(self) -> ChipStatus:
        """Ask the chip whether it is at rest, and return what is known of it: each byte that was read since the last command that
        may have changed it, and None for the others.

        The chip stores one command for that. `counter`, `variable`, `flags`, `functions` and `byte` read; for each byte the chip
        stores two commands, which overwrite the oldest ones in its command memory. Raises `Busy` while the chip moves.
        """
        async with self._unit.turn():
            await self._unit.rest()
        return self.known()

    def known(self) -> ChipStatus:
        """Known state of the chip, as `status` returns it. Nothing is sent."""
        shared = self._unit.shared
        counter, flags, is_valid = shared.reading(1), shared.readings.get(14), shared.is_position_valid
        return ChipStatus(
            type=self.variant.title,
            interface=None if shared.interface is None else shared.interface.title,
            series=shared.readings.get(16),
            counter_u=counter,
            position=None if counter is None else self._in_units(counter),
            unit=self.unit,
            is_position_valid=is_valid,
            variable=shared.reading(4),
            flags=None if flags is None else _flags(flags),
            functions=self._functions() if shared.readings.keys() >= set(FUNCTION_BYTES) else None,
        )

    async def interface(self) -> Interface | None:
        """The driver interface, which pins select; it is read once. None for a number that no interface has."""
        async with self._unit.turn():
            if self._unit.shared.interface is None:
                await self._unit.rest()
            return await self._unit.find_interface()

    async def is_busy(self) -> bool:
        """Whether the chip moves, waits or runs its program."""
        async with self._unit.turn():
            return await self._unit.query_type() is None

    # ------------------------------------------------------------------ settings

    async def configure(
        self,
        *,
        start_stop: float | None = None,
        acceleration: float | None = None,
        velocity: float | None = None,
        profile: float | None = None,
        microstep: int | None = None,
        qualification: int | None = None,
        waveform: int | None = None,
    ) -> None:
        """Set S, V, P (full steps/s), A (full steps/s²), M, Q and N, as the commands take them; M and Q before the others.

        Raises `Misuse` with the permitted range, for M and Q that do not go together too.
        """
        unit = self._unit
        given = {
            "microstep": microstep,
            "qualification": qualification,
            "start_stop": start_stop,
            "acceleration": acceleration,
            "velocity": velocity,
            "profile": profile,
            "waveform": waveform,
        }
        numbers = {
            name: checked_number(COMMANDS[name], value, unit.variant, name) for name, value in given.items() if value is not None
        }
        wanted = unit.shared.settings.with_(**numbers)
        wanted.check()
        async with unit.turn():
            await unit.rest()
            for name, number in numbers.items():
                unit.shared.settings = unit.shared.settings.with_(**{name: None})
                await unit.send(f"{COMMANDS[name]}{number}")
                unit.shared.settings = unit.shared.settings.with_(**{name: number})

    async def set_position(self, position: float) -> None:
        """Set the position counter. The motor does not move."""
        counter = self._counter_of(position)
        async with self._unit.turn():
            await self._unit.rest()
            self._unit.shared.is_position_valid = False
            await self._unit.send(f"={counter}" if counter else "c100")
            self._unit.shared.note_counter(counter)
            self._unit.shared.is_position_valid = True

    async def set_output(self, line: int, on: bool) -> None:
        """Set B1 to B21 high or low."""
        if line not in LINES:
            raise Misuse(UNKNOWN_LINE(line=line, least=LINES[0], most=LINES[-1]))
        async with self._unit.turn():
            await self._unit.rest()
            interface = await self._unit.find_interface()
            if interface is not None and line in interface.occupied:
                raise Misuse(LINE_OF_AN_INTERFACE(line=line, title=interface.title))
            await self._send_switch(line, on)

    async def set_flag(self, flag: int, on: bool) -> None:
        """Set user flag 80 to 86."""
        if flag not in USER_FLAGS:
            raise Misuse(UNKNOWN_FLAG(flag=flag, least=USER_FLAGS[0], most=USER_FLAGS[-1]))
        await self._switch(flag, on)

    async def set_function(self, function: int, on: bool) -> None:
        """Switch function 40 to 63. 41 (echo) and 57 (report) are reserved for the driver."""
        if function not in FUNCTIONS:
            raise Misuse(UNKNOWN_FUNCTION(function=function, least=FUNCTIONS[0], most=FUNCTIONS[-1]))
        if function in (RETURN, REPORT):
            raise Misuse(FUNCTION_IS_OF_THE_DRIVER(function=function, level="ON" if function == RETURN else "OFF"))
        await self._switch(function, on)
        self._unit.shared.note_function(function, on=on)

    async def set_limit(self, on: bool) -> None:
        """Select whether LIMIT stops the motor (function 42 OFF), for example to leave the switch."""
        await self.set_function(LIMITOFF, not on)

    async def _switch(self, number: int, on: bool) -> None:
        async with self._unit.turn():
            await self._unit.rest()
            await self._send_switch(number, on)

    async def _send_switch(self, number: int, on: bool) -> None:
        await self._unit.send(f"{'t' if on else 'c'}{number}", acts=True)

    async def set_variable(self, number: int) -> None:
        """Set the internal variable, 0 to 2^24 − 1."""
        checked_number(":", number, self.variant, "the internal variable")
        async with self._unit.turn():
            await self._unit.rest()
            await self._unit.send(f":{number}")

    async def inputs(self, first: int = 1, count: int = 4) -> tuple[bool, ...]:
        """Levels of up to nine lines from ``first`` on. This overwrites the internal variable."""
        checked_number("?", 10 * first + count, self.variant, f"{count} lines from B{first} on")
        async with self._unit.turn():
            await self._unit.rest()
            await self._unit.send(f"?{10 * first + count}")
            bits = await self._unit.read_number(4, rests=True)
        return tuple(bool(bits >> bit & 1) for bit in range(count))

    # ------------------------------------------------------------------ motion

    async def move_to(self, position: float) -> None:
        """Begin to move to a position, rounded to a microstep. `wait` waits for the end.

        Raises `Misuse` for a position outside the counter, `Busy`, `PositionUnknown`; `DoubtfulMove` if it is unknown whether
        the move has begun. R is sent only once.
        """
        target = self._counter_of(position)
        unit = self._unit
        permission = unit.permission()
        async with unit.turn(permission):
            before = await unit.read_number(1)
            self._check_position()
            await self._move(f"g{target}" if target else "h", target - before, target, permission)

    async def move_by(self, distance: float) -> None:
        """Begin to move by a distance, rounded to a microstep. Errors as `move_to`."""
        if not isfinite(distance):
            raise Misuse(NO_DISTANCE(distance=distance, unit=self.unit))
        distance_u = self._on_grid(distance, 0)
        if abs(distance_u) > LARGEST:
            raise Misuse(DISTANCE_IS_OUT_OF_RANGE(distance=distance, unit=self.unit, most=LARGEST / self.scale_u))
        unit = self._unit
        permission = unit.permission()
        async with unit.turn(permission):
            before = await unit.read_number(1)
            text = f"{'f' if distance_u > 0 else 'b'}{abs(distance_u)}"
            await self._move(text, distance_u, before + distance_u & MASK, permission)

    async def _move(self, specification: str, distance_u: int, target_u: int, permission: Permission) -> None:
        if distance_u == 0:
            shared = self._unit.shared
            shared.motion = ChipMotionCommand(ChipMotion.MOVE, self.line.now(), shared.stops, target_u, 0.0)
            return
        await self._unit.send(specification)
        duration = self.settings.travel_s(distance_u, self.variant)
        await begin(self._unit, "r", ChipMotion.MOVE, permission, target_u=target_u, duration_s=duration)

    async def run(self, direction: int, velocity: float | None = None) -> None:
        """Run until stopped, in direction +1 or −1; ``velocity`` sets V first (full steps/s)."""
        if direction not in (1, -1):
            raise Misuse(f"direction {direction}: permitted are 1 and -1")
        permission = self._unit.permission()
        if velocity is not None:
            await self.configure(velocity=velocity)
        async with self._unit.turn(permission):
            await self._unit.rest()
            await self._unit.send("g+" if direction > 0 else "g-")
            await begin(self._unit, "r", ChipMotion.ENDLESS, permission)

    def jog(self, velocity: float) -> AsyncM1486Jog:
        """A jog at a velocity (units/s), as long as it is held: ``async with chip.jog(5.0) as jog: while pressed(): await
        jog.hold()``. See `AsyncM1486Jog`."""
        return AsyncM1486Jog(self, velocity)

    async def seek(self, direction: int, line: int) -> None:
        """Begin to move at start/stop speed until a line has its end level: low for B1–3, 8–11, 16–19, else high.

        The number of the line is passed in the internal variable, so that no garbled digit can select another line.
        """
        if direction not in (1, -1):
            raise Misuse(f"direction {direction}: permitted are 1 and -1")
        checked_number(")", line, self.variant, "the line to seek")
        permission = self._unit.permission()
        async with self._unit.turn(permission):
            await self._unit.rest()
            await self._unit.send(f":{line}")
            await begin(self._unit, ")" if direction > 0 else "(", ChipMotion.SEEK, permission)

    async def start_program(self, label: int) -> None:
        """Start the program in the command memory at a label. Its number is passed in the internal variable, as of `seek`.

        It is known where a program leads that was downloaded on this line. Raises `Misuse` where its end can be reached from the
        label: behind it the chip would execute what was sent since, and with that the J that starts it, again and again (M-12).
        Raises `ProgramLost` where what was sent since has overwritten it, and for a chip that is at rest at once, as without the
        label.
        """
        checked_number("j", label, self.variant, "the label")
        unit = self._unit
        permission = unit.permission()
        part = unit.shared.sent.part(label, unit.variant, unit.shared.interface)
        if part is not None and part.has_end:
            raise Misuse(END_IS_REACHED(label=label))
        async with unit.turn(permission):
            await unit.rest()
            spare = None if part is None else unit.spare_bits(part.begins_at)
            if spare is not None and spare < START_BITS:
                raise ProgramLost(LABEL_IS_NOT_STARTED(place=self.line.place, label=label, why=_lost(spare, unit.variant)))
            await unit.send(f":{label}")
            await begin(unit, "j", ChipMotion.BLOCK, permission, label=label)
            if not await unit.runs_at_once():
                unit.shared.motion = None
                raise ProgramLost(PROGRAM_IS_NOT_STARTED(place=self.line.place, chip=unit.name, label=label))

    async def stop(self) -> bool:
        """Brake with the ramp, and end a program: nothing begins any more that was asked for before, also if this process dies
        now. It precedes all waiting requests; moves that wait for the line are not begun.

        A motion that has begun is ended by K, everything else by wrong data and K in one burst. Returns whether a program that
        ran has ended: False where function 44 is ON or not known (`open_line`). Then the burst is sent twice, because an E type
        may still be writing a motion into its EEPROM, and a program may go on: `stop_program` finds out. Raises
        `steptwin.drivers.Unconfirmed`.
        """
        self._note_stop()
        return await self._unit.kill()

    def _note_stop(self) -> None:
        """Note that the counter does not show the position any more, where a stop cuts a move short (M-16). Nothing is known of
        what a chip does that was not opened."""
        shared = self._unit.shared
        motion = shared.motion
        is_cut = motion is not None and motion.kind in (ChipMotion.MOVE, ChipMotion.BLOCK) and not motion.is_over(self.line.now())
        if is_cut or shared.variant is None:
            shared.is_position_valid = False

    async def recover(self) -> None:
        """Continue what Kill has stopped (C75), if function 51 is OFF. A program may move the motor at once."""
        permission = self._unit.permission()
        async with self._unit.turn(permission):
            await self._unit.act("c75", permission, stored=False)
            self._unit.shared.is_killed = False

    async def stop_program(self, timeout_s: float = 10.0) -> None:
        """End motion and program: the motion by Kill, the program by wrong data (function 44 must be OFF). Nothing is erased.

        What Kill holds (function 51 OFF) is released only where function 44 is known to be OFF, so that nothing of it is left.
        Raises `Busy` if the chip is not at rest then: it is held, which only `recover` (it goes on) or `reset` ends, or goes on,
        and only `reset` or RST helps, and the position is lost.
        """
        unit = self._unit
        shared = unit.shared
        self._note_stop()
        has_ended = await unit.kill(program=True)
        is_held = shared.function(RECOVER) is not True and not has_ended
        # Another stop does not forbid C75: it leaves nothing that could begin.
        permission = Permission(self.line.now, PATIENCE_NS)
        async with unit.turn(permission):
            unit.talk.settle(unit.address)  # questions went with the program
            if has_ended:
                if shared.function(RECOVER) is not True:
                    await unit.act("c75", permission, stored=False)
                shared.is_killed = False
            shared.motion = None
            if await unit.query_type(round(timeout_s * SECOND)) is None:
                if is_held:
                    raise Busy(IS_NOT_AT_REST(place=self.line.place, chip=unit.name))
                raise Busy(CONTINUES(place=self.line.place, chip=unit.name))

    async def wait(self, timeout_s: float | None = None, *, check: bool = True) -> ChipMoveEnd:
        """Wait until the chip has executed all commands, and return why a motion ended.

        Without ``timeout_s`` the time-out is computed from the motion if all settings are known, else it is a minute. Other
        chips can use the line until shortly before the computed end, and the ends of their moves are watched, too; a wait of
        unknown length keeps the line, except for stops. Raises `ChipMoveFailed` unless the motion ended as intended, and a
        `LineFailure` if the line fails; with ``check`` false both are returned as the end.
        """
        end = await wait_for(self._unit, timeout_s, self.unit, self._in_units, check=check)
        if check and not end.ok:
            raise ChipMoveFailed(end)
        return end

    # ------------------------------------------------------------------ commands and programs

    async def command(self, text: str) -> None:
        """Send one command, such as ``t6`` or ``f12800``. Commands that move, jump or answer have methods of their own.

        Raises `Misuse` for a command that the chip would drop.
        """
        await self.commands([text])

    async def commands(self, texts: Iterable[str]) -> None:
        """Send commands one after the other, as `command`, all checked before the first is sent. Behind a stop nothing of them
        is sent."""
        unit = self._unit
        typed = [self.check_command(text) for text in texts]
        permission = unit.permission()
        for command in typed:
            async with unit.turn(permission):
                await unit.rest()
                self._learn(command)
                await unit.act(command, permission, once=command[0] in _ONCE)
                permission.extend()

    def check_command(self, text: str) -> str:
        """A command as `command` sends it. Raises `Misuse` for others."""
        typed = self._unit.checked(text)
        if typed == "c75":
            raise Misuse(f"{text!r} is not a command to type alone: recover continues what Kill has stopped")
        if typed[0] not in _TYPED:
            raise Misuse(f"{text!r} is not a command to type alone: motions, files and questions have methods of their own")
        return typed

    def _learn(self, typed: str) -> None:
        """Forget a setting that a typed command changes, until it is configured again."""
        shared = self._unit.shared
        name = next((name for name, letter in COMMANDS.items() if letter == typed[0]), None)
        if name is not None:
            shared.settings = shared.settings.with_(**{name: int(typed[1:]) if typed[1:] else None})
        if typed[0] in "tc" and typed[1:].isdecimal() and int(typed[1:]) in FUNCTIONS:
            shared.note_function(int(typed[1:]), on=typed[0] == "t")
        elif typed in ("t", "c"):  # the internal variable has the number
            shared.forget_functions(*FUNCTIONS)

    async def run_block(self, commands: Iterable[str], timeout_s: float | None = None) -> ChipMoveEnd:
        """Have commands done one after the other, as a file in ``[ ]`` that nothing of runs before it is there whole, and wait
        until the last one is done. An upload that is typed as the last of them reports it (manual chapter II, Memory):
        without it the block was cut short (``ChipReason.CUT``), as by a command that is wrong data when it comes to be done.

        Not for E types, which would keep it in their EEPROM. ``timeout_s``: by default a minute. Raises `Misuse` for commands
        that have no place in a block, `FileGivenUp` when it could not be typed whole.
        """
        check_wait(timeout_s)
        unit = self._unit
        if unit.variant.store is Store.EEPROM:
            raise Misuse(f"{unit.variant.title} writes what is in [ ] into its EEPROM: use download")
        typed = [unit.checked(command) for command in commands]
        for command in typed:
            if command[0] in _NOT_IN_BLOCK or command == "c75":
                raise Misuse(f"{command!r} has no place in a block")
        if 8 + sum(memory_bits(command[0].upper()) for command in (*typed, MARK)) > unit.variant.memory_bits - 8:
            raise Misuse(f"the block is larger than the command memory of {unit.variant.title}, {unit.variant.memory_bits} bits")
        permission = unit.permission()
        async with unit.turn(permission):
            await unit.rest()
            await type_file(unit, ["[", *typed, MARK, "]"], permission, lambda count: None)
            if unit.shared.motion is not None:
                unit.shared.motion.is_marked = True
        return await self.wait(timeout_s if timeout_s is not None else UNKNOWN_S)

    async def uploaded(self, count: int = 1, timeout_s: float = 10.0) -> bytes:
        """The next bytes that the program of the chip uploads, in order: each ``U`` among its commands sends one (manual
        chapter VII, Upload).

        The program must have been started by this driver, and no other on this line, because bytes carry no sender: else
        `Misuse`. Raises `LineFailure` at the time-out; bytes that have arrived are kept for the next call.
        """
        check_wait(timeout_s)
        unit = self._unit
        if count < 1:
            raise Misuse(f"{count} bytes: at least 1")
        kept = unit.shared.uploads
        if kept is None:
            raise Misuse(f"{self.line.place}: no program of {unit.name} was started here: download or start_program")
        if any(shared.motion is not None and shared.motion.kind is ChipMotion.BLOCK for shared in unit.others()):
            raise Misuse(
                f"{self.line.place}: another chip runs a program too, so that bytes are not attributable: wait for its end"
            )
        limit = self.line.now() + round(timeout_s * SECOND)
        while len(kept) < count:
            async with unit.turn():
                await unit.receive_upload(SLICE_NS)
            if len(kept) < count and self.line.now() >= limit:
                raise LineFailure(f"{self.line.place}: {unit.name} uploaded {len(kept)} of {count} bytes within {timeout_s:g} s")
        found = bytes(kept[:count])
        del kept[:count]
        return found

    async def reset(self, *, force: bool = False) -> None:
        """``\\``: defaults, position 0, and an E type forgets its stored file. Raises `Busy` while the chip does something.

        ``force``: also then; Kill stops its motion first, and an incomplete file in ``[ ]`` is discarded.
        """
        unit = self._unit
        if force:
            await self.stop()
        async with unit.turn():
            if not force:
                await unit.rest()
                await unit.find_interface()
            await reset(unit)

    async def download(self, text: str, *, progress: DownloadProgress | None = None, name: str = "program") -> bytes:
        """Send a program to the chip: a file in ``[ ]``, which runs from ``]`` on and which an E type stores, or plain
        commands.

        An E type is erased before a file. Returns the bytes that ``U`` outside ``[ ]`` uploaded. Raises `Misuse` with the first
        errors of the checker, `NoRoom`, `FileGivenUp`.
        """
        return await send_program({self.address: self._unit, None: self._unit}, text, progress=progress, name=name)


BEGINNING_IS_OVERWRITTEN = Message(
    "drivers.m1486.beginning-is-overwritten",
    "what was sent since the program, questions too, has filled the {size} bits of the command memory and overwritten its "
    "beginning: download it anew",
)
NO_ROOM_TO_START = Message(
    "drivers.m1486.no-room-to-start",
    "the program and what was sent since fill the {size} bits of the command memory but for {spare}; a start takes "
    "{start}: download it anew",
)


def _lost(spare_bits: int, variant: Variant) -> str:
    if spare_bits < 0:
        return BEGINNING_IS_OVERWRITTEN(size=variant.memory_bits)
    return NO_ROOM_TO_START(size=variant.memory_bits, spare=spare_bits, start=START_BITS)


async def download_to(
    chips: Iterable[AsyncM1486],
    text: str,
    *,
    first: AsyncM1486 | None = None,
    progress: DownloadProgress | None = None,
    name: str = "program",
) -> bytes:
    """Send a program that selects its chips with ``X`` to chips on one line, all of one type.

    ``first`` gets the commands before any ``X``. Errors as of `AsyncM1486.download`.
    """
    units = {chip.address: chip._unit for chip in chips}
    if first is not None:
        units[None] = first._unit
    return await send_program(units, text, progress=progress, name=name)

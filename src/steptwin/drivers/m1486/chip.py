"""Opening, reading and setting a chip. The motions are in `steptwin.drivers.m1486.driver`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from types import TracebackType
from typing import Self

from steptwin.drivers.line import DriverLine
from steptwin.drivers.m1486.failures import Busy, PositionUnknown, WrongType
from steptwin.drivers.m1486.lines import BAUD, AsyncM1486Line
from steptwin.drivers.m1486.notes import FUNCTION_BYTES
from steptwin.drivers.m1486.settings import COMMANDS, ChipSettings, checked_number
from steptwin.drivers.m1486.talk import ChipRequest
from steptwin.drivers.m1486.unit import ChipUnit
from steptwin.errors import Misuse
from steptwin.m1486.functions import CARRY, FUNCTIONS, LIMITOFF, REPORT, RETURN, USER_FLAGS
from steptwin.m1486.lines import LINES, Interface
from steptwin.m1486.microsteps import FULL_STEP
from steptwin.m1486.variants import Variant
from steptwin.m1486.variants import variant as variant_named
from steptwin.machine import SECOND
from steptwin.messages import Message

TIMEOUT_S = 0.5
LARGEST = 16_000_000
"""Farthest distance and position of F, B, G and =, in minimum microsteps."""


@dataclass(frozen=True, slots=True)
class ChipStatus:
    """What is known of a chip at rest; None: not read since the last command that may have changed it."""

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


class AsyncChip:
    """See `steptwin.drivers.m1486.driver.AsyncM1486`."""

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
        return self._unit.notes.settings

    # ------------------------------------------------------------------ opening

    async def open(self) -> None:
        """Open the line, switch on the echo of the chip and determine its type. Without an address it also finds out whether the
        chip is the only one.

        Raises `NoEcho`, `Busy` while it moves, `SeveralChips`, `WrongType`.
        """
        await self.line.open()
        notes = self._unit.notes
        before = notes.variant
        try:
            async with self._unit.turn():
                self._take_type()
                await self._unit.look()
        except BaseException as error:
            is_known = isinstance(error, Busy) or (self._variant is not None and not isinstance(error, WrongType))
            notes.variant = before if is_known else None  # else there may be another chip now
            await self.close()
            raise

    def _take_type(self) -> None:
        """Take the type that was named. Raises `Misuse` where another one is known; one for 24 MHz answers like that for 12 MHz,
        so the clock that was named counts."""
        notes, named = self._unit.notes, self._variant
        known = notes.variant
        if named is None or named is known:
            return
        if known is not None and known.type_letter != named.type_letter:
            raise Misuse(OTHER_TYPE_IS_KNOWN(place=self.line.place, name=self._unit.name, title=known.title, named=named.title))
        notes.variant = named

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
        return self._shown(counter)

    def _check_position(self) -> None:
        if not self._unit.notes.is_position_valid:
            raise PositionUnknown(COUNTER_SHOWS_THE_TARGET(place=self.line.place, chip=self._unit.name))

    def _shown(self, counter_u: int) -> float:
        return (counter_u - self.origin_u) / self.scale_u

    def _counter_of(self, position: float) -> int:
        if not isfinite(position):
            raise Misuse(NO_POSITION(position=position, unit=self.unit))
        counter = self._on_grid(position, self.origin_u)
        if not 0 <= counter <= LARGEST:
            least, most = self._shown(0), self._shown(LARGEST)
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
        return {number: bool(self._unit.notes.function(number)) for number in FUNCTIONS}

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
        """What is known of the chip, as `status` returns it. Nothing is sent."""
        notes = self._unit.notes
        counter, flags, is_valid = notes.reading(1), notes.readings.get(14), notes.is_position_valid
        return ChipStatus(
            type=self.variant.title,
            interface=None if notes.interface is None else notes.interface.title,
            series=notes.readings.get(16),
            counter_u=counter,
            position=None if counter is None else self._shown(counter),
            unit=self.unit,
            is_position_valid=is_valid,
            variable=notes.reading(4),
            flags=None if flags is None else _flags(flags),
            functions=self._functions() if notes.readings.keys() >= set(FUNCTION_BYTES) else None,
        )

    async def interface(self) -> Interface | None:
        """The driver interface, which pins select; it is read once. None for a number that no interface has."""
        async with self._unit.turn():
            if self._unit.notes.interface is None:
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
        wanted = unit.notes.settings.with_(**numbers)
        wanted.check()
        async with unit.turn():
            await unit.rest()
            for name, number in numbers.items():
                unit.notes.settings = unit.notes.settings.with_(**{name: None})
                await unit.send(f"{COMMANDS[name]}{number}")
                unit.notes.settings = unit.notes.settings.with_(**{name: number})

    async def set_position(self, position: float) -> None:
        """Set the position counter. The motor does not move."""
        counter = self._counter_of(position)
        async with self._unit.turn():
            await self._unit.rest()
            self._unit.notes.is_position_valid = False
            await self._unit.send(f"={counter}" if counter else "c100")
            self._unit.notes.note_counter(counter)
            self._unit.notes.is_position_valid = True

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
        self._unit.notes.note_function(function, on=on)

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

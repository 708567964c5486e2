"""The parts of an M1486, and what they ask of the chip: its outputs, functions, file, defaults, events.

`steptwin.m1486.chip.M1486Chip` drives them from outside: time, characters, pins, power.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import ClassVar

from steptwin.errors import Misuse
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.eeprom import pack, unpack
from steptwin.m1486.effects import WrongData
from steptwin.m1486.events import EVENTS_KEPT, M1486Event
from steptwin.m1486.functions import COMPLEMENT, CONTINUE, EDGE, LIMITOFF, RECOVER, RUNSIGN
from steptwin.m1486.lines import Interface
from steptwin.m1486.memory import CommandMemory, FileState
from steptwin.m1486.motor import MotorControl
from steptwin.m1486.pins import LINE_PINS, OPEN_ADDRESS, ChipPins, baud_pins
from steptwin.m1486.program import ProgramExecution
from steptwin.m1486.receiver import Receiver
from steptwin.m1486.signals import data_level
from steptwin.m1486.uart import Uart
from steptwin.m1486.unit import NumericUnit
from steptwin.m1486.variants import Store, Variant
from steptwin.machine import Fact, Nanos, PinEdge
from steptwin.state import Stateful


class ChipCore(Stateful):
    """See `steptwin.m1486.chip.M1486Chip`. Moments are arguments; it has no clock and no deadlines.

    Satisfies `steptwin.m1486.effects.CommandHost`, `steptwin.m1486.motor.MotorHost`, `steptwin.m1486.program.ProgramHost` and
    `steptwin.m1486.receiver.ReceiverHost`.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("is_timed", "on_event", "on_sent", "store", "variant")
    __slots__ = (
        *FIXED,
        "_edges",
        "address",
        "events",
        "image",
        "interface",
        "io",
        "is_shut_down",
        "memory",
        "motor",
        "program",
        "receiver",
        "uart",
        "unit",
    )

    def __init__(
        self,
        variant: Variant,
        address: int,
        interface: Interface,
        baud: int | None,
        statement_ns: Nanos | None,
        *,
        is_timed: bool,
        image: bytes,
    ) -> None:
        if not 0 <= address <= OPEN_ADDRESS:
            raise Misuse(f"address {address}: four pins give 0 to {OPEN_ADDRESS}")
        if statement_ns is not None and statement_ns < 0:
            raise Misuse(f"statement_ns = {statement_ns}: must not be negative")
        self.variant = variant
        self.is_timed = is_timed
        self.store: Callable[[bytes], bytes | None] | None = None
        self.on_event: Callable[[M1486Event], None] | None = None
        self.on_sent: Callable[[], None] | None = None

        self.image = image
        file = unpack(image, variant)
        self.events: deque[M1486Event] = deque(maxlen=EVENTS_KEPT)
        self._edges: list[PinEdge] = []
        self.is_shut_down = False
        self.interface = interface
        self.unit = NumericUnit()
        self.io = ChipPins(address, baud_pins(variant, baud), interface, self._level_changed)
        self.address = self.io.address()
        self.uart = Uart(variant.baud(*self.io.baud_pins()), is_timed=is_timed)
        self.program = ProgramExecution(
            self, 2 * variant.memory_bits // 8, variant.statement_ns if statement_ns is None else statement_ns
        )
        self.memory = CommandMemory(variant, self.program)
        self.motor = MotorControl(self, ChipDrive(variant, interface))
        self.receiver = Receiver(self)
        if file is not None and (variant.store is Store.RAM or self.address != 0):
            self.memory.load(file)

    @property
    def drive(self) -> ChipDrive:
        return self.motor.drive

    # ------------------------------------------------------------------ lines and characters

    def _level_changed(self, name: str, level: int, now: Nanos) -> None:
        self._edges.append(PinEdge(now, name, float(level)))
        line = LINE_PINS.get(name)
        if line is not None and not self.is_shut_down:
            self.program.line_changed(line, level)
            self.motor.line_changed(line, level, now)

    def level(self, line: int, now: Nanos) -> int:
        """The level that is read on a line; on a pin of the driver interface, the interface's signal (M-21)."""
        if line in self.interface.occupied:
            return data_level(line, self.drive.currents(now))
        return self.io.levels[line]

    def send(self, byte: int, now: Nanos) -> None:
        if self.uart.send(byte, now) and self.on_sent is not None:
            self.on_sent()

    # ------------------------------------------------------------------ interface to commands

    def read(self, lines: range, now: Nanos) -> int:
        """Lines as a number, lowest line = least significant bit; inverted by function 47."""
        number = sum(self.level(line, now) << bit for bit, line in enumerate(lines))
        return number ^ (1 << len(lines)) - 1 if self.unit.on(COMPLEMENT) else number

    def refuse_occupied(self, line: int) -> None:
        """Raises `WrongData` for a line whose pin the driver interface uses (M-21)."""
        if line in self.interface.occupied:
            raise WrongData(f"B{line} belongs to the {self.interface.title} interface")

    def put_out(self, lines: range, bits: int, now: Nanos) -> None:
        """Set outputs, lowest line = least significant bit. Raises `WrongData` if the interface uses one (M-21)."""
        for line in lines:
            self.refuse_occupied(line)
        for bit, line in enumerate(lines):
            level = bits >> bit & 1
            if self.io.latches[line] != level:
                self.event("output", f"B{line} {'high' if level else 'low'}", now, ("line", line), ("level", level))
                self.io.set_latch(line, level, now)

    def switch(self, function: int, on: bool, now: Nanos) -> None:
        """T and C of a function."""
        self.unit.switch(function, on)
        if function == RUNSIGN:
            self.motor.show_runsign(now)
        elif function in (LIMITOFF, EDGE, RECOVER):
            self.motor.look_at_limit(now)

    def upload(self, number: int, byte: int, now: Nanos) -> None:
        self.event("upload", f"U{number} sends {byte:02X}H", now, ("command", number), ("byte", byte))
        self.send(byte, now)

    def event(self, code: str, text: str, now: Nanos, *facts: Fact) -> None:
        event = M1486Event(now, code, text, facts)
        self.events.append(event)
        if self.on_event is not None:
            self.on_event(event)

    def wrong_data(self, what: str, now: Nanos) -> None:
        """Drop a command and stop the program, unless function 44 is ON (M-11)."""
        stops = not self.unit.on(CONTINUE)
        self.event(
            "wrong-data", f"wrong data: {what}{'; the program stops' if stops else ''}", now, ("why", what), ("stops", stops)
        )
        if stops:
            self.program.abandon(now)

    # ------------------------------------------------------------------ interface to the receiver

    def wrong_data_received(self, what: str, now: Nanos) -> None:
        """As `wrong_data`; a file that is being received does not run then."""
        self.wrong_data(what, now)
        if self.memory.file is FileState.OPEN and not self.unit.on(CONTINUE):
            self.memory.refuse_file()

    def kill(self, now: Nanos) -> None:
        self.event("kill", "Kill", now)
        self.motor.kill(now)

    def halt(self, now: Nanos) -> None:
        """A stop of its world: the motor goes down its ramp, and nothing else of what it was given before is executed.

        As wrong data and Kill in one burst that overtakes what is on the line, in the input buffer and in an EEPROM. It works
        with function 44 ON, too, and with 51 OFF it does not hold the commands behind it. A file that is being received does not
        run.
        """
        self.receiver.discard(self.uart.take_arriving(), now)
        if self.memory.file is FileState.OPEN:
            self.memory.refuse_file()
        elif self.memory.file is FileState.CLOSED:
            self.memory.enable()  # what an EEPROM is being written with is passed over, too
        self.motor.kill(now)
        self.program.abandon(now)
        self.program.is_killed = False

    def clear_kill(self, now: Nanos) -> None:
        self.event("clear-kill", "Clear kill", now)
        self.program.is_killed = False

    def close_file(self, now: Nanos) -> None:
        """``]``: the file runs, and an E type keeps it."""
        file = self.memory.close_file()
        if file is None:
            return
        self.event("file", f"a file of {8 * len(file.code)} bits", now, ("size", 8 * len(file.code)))
        if self.variant.store is Store.EEPROM:
            self._keep(pack(file), now)  # M-37: nothing else is kept

    def software_reset(self, now: Nanos) -> None:
        """``\\``: defaults; an E type erases its EEPROM. Address and baud rate stay."""
        self.event("reset", "reset", now)
        self.set_defaults(now)
        if self.variant.store is Store.EEPROM:
            self._keep(b"", now)
            self.receiver.erase(now)

    def _keep(self, image: bytes, now: Nanos) -> None:
        stored = None
        if self.store is not None:
            try:
                stored = self.store(image)
            except OSError as error:
                self.event("store-failed", f"the EEPROM could not be kept: {error}", now, ("why", str(error)))
        self.image = image if stored is None else stored

    def set_defaults(self, now: Nanos) -> None:
        """The motor stands, outputs are released, settings and memory are as after power-on."""
        self.motor.stop_at_once(now)
        self.io.release_outputs(now)
        self.interface = self.io.interface()
        self.unit.reset()
        self.drive.reset_settings(self.variant, self.interface)
        self.drive.set_counter(0, now)
        self.memory.reset()
        self.program.reset(now)

"""The M1486 as a pure machine: serial port, command memory, program, motor, pins.

A chip is made from the levels of its pins and its timing, and driven by four calls::

    chip = M1486Chip(variant("E1"), address=3, interface=DUAL_DAC, baud=4800, is_timed=True, image=kept)
    chip.receive(b"f12800\\rr\\r", now)  # characters from the host; chips that share a line: `steptwin.m1486.line`
    chip.set_pin("B3", 0, now)  # and what happens outside
    chip.advance(chip.deadline())  # time
    chip.to_send(now)  # characters to the host, with their moments

Its actions are reported by ``on_event`` (moves, waits, outputs, uploads, stops, wrong data), `take_edges` (pins) and
``drive`` (motion: `ChipDrive.train` is the pulse train in force, `ChipDrive.revision` counts trains; `steptwin.m1486.signals`
makes pulses and converter data of it). A program file is in the memory from the start when ``image`` is what
`steptwin.m1486.eeprom.image_of` makes of it; it then runs at power-on, on chips with RAM as well as on those with EEPROM.
`M1486Chip.snapshot` and `M1486Chip.restore` (or `copy_state` and `set_state`, without their check) take all state out and put
it back.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from steptwin.controller import MILLISECOND, Fact, Nanos, PinEdge
from steptwin.errors import Misuse, TimeReversal
from steptwin.m1486.drive import ChipDrive
from steptwin.m1486.eeprom import pack, unpack
from steptwin.m1486.effects import WrongData
from steptwin.m1486.events import EVENTS_KEPT, M1486Event
from steptwin.m1486.functions import COMPLEMENT, CONTINUE, EDGE, LIMITOFF, OUTPUTS, RECOVER, RUNSIGN
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.memory import CommandMemory, FileState
from steptwin.m1486.motor import MotorControl
from steptwin.m1486.pins import LINE_PINS, OPEN_ADDRESS, WAVEFORM, ChipPins, baud_pins, settable_pin
from steptwin.m1486.program import ProgramExecution
from steptwin.m1486.receiver import Receiver
from steptwin.m1486.signals import data_level
from steptwin.m1486.uart import Uart
from steptwin.m1486.unit import NumericUnit
from steptwin.m1486.variants import DEFAULT, Store, Variant
from steptwin.messages import Message, text_of
from steptwin.state import Plain, Stateful

SHUTDOWN_RESET_NS: Nanos = 10 * MILLISECOND
"""RST has to be high for so long to end shutdown (chapter IV, Shutdown mode)."""


@dataclass(frozen=True, slots=True)
class ChipSnapshot:
    """All state of a chip at a moment, with its type and timing. It can be pickled; motions are shared."""

    variant: Variant
    is_timed: bool
    statement_ns: Nanos
    state: Plain


WRONG_ADDRESS = Message("m1486.wrong-address", "address {address}: four pins give 0 to {most}")
OUTPUT_HIGH = Message("m1486.output-high", "B{line} high")
OUTPUT_LOW = Message("m1486.output-low", "B{line} low")
WRONG_DATA = Message("m1486.wrong-data", "wrong data: {what}")
WRONG_DATA_STOPS = Message("m1486.wrong-data-stops", "wrong data: {what}; the program stops")
POWER_ON = Message("m1486.power-on", "power-on")
RESET_BY_RST = Message("m1486.reset-by-rst", "RST with all address pins low: reset")
RESTART_BY_RST = Message("m1486.restart-by-rst", "RST: the program begins again")
SHUTDOWN = Message("m1486.shutdown", "shutdown")
SHUTDOWN_IS_OVER = Message("m1486.shutdown-is-over", "shutdown is over: the program begins again")
LINE_OF_AN_INTERFACE = Message("m1486.line-of-an-interface", "B{line} belongs to the {interface} interface")
BYTE_IS_SENT = Message("m1486.byte-is-sent", "U{number} sends {byte:02X}H")
KILL = Message("m1486.kill", "Kill")
CLEAR_KILL = Message("m1486.clear-kill", "Clear kill")
FILE = Message("m1486.file", "a file of {size} bits")
RESET = Message("m1486.reset", "reset")
EEPROM_IS_NOT_KEPT = Message("m1486.eeprom-is-not-kept", "the EEPROM could not be kept: {why}")
SNAPSHOT_OF_ANOTHER_CHIP = Message(
    "m1486.snapshot-of-another-chip", "the snapshot is of {title} with other timing, or of another type than {own}"
)


NEGATIVE_STATEMENT_TIME = Message("m1486.negative-statement-time", "statement_ns = {statement_ns}: must not be negative")


class M1486Chip(Stateful):
    """One chip. Characters and pins are applied after everything that is due at their moment.

    ``address`` (0-15), ``interface`` and ``baud`` (bit/s, one of the variant's four, by default the fastest) are how pins are
    tied at power-on. ``statement_ns`` is the time of a command (M-19), 0 permitted. ``is_timed``: characters take their time on
    the wire. ``image`` is the stored file the chip is switched on with (`steptwin.m1486.eeprom`); chips with RAM lose it when
    they are switched off. Raises `Misuse`.

    Hooks: ``store`` is called with the image whenever the EEPROM has a new one (empty: erased) and returns when it is safe: None,
    or what was stored instead; an `OSError` if it could not be stored. ``changed`` is called whenever the next deadline or an
    output may have changed, ``on_event`` for every event, ``on_sent`` when characters have left.

    Satisfies `steptwin.m1486.effects.CommandHost`, `steptwin.m1486.motor.MotorHost`, `steptwin.m1486.program.ProgramHost` and
    `steptwin.m1486.receiver.ReceiverHost`.
    """

    FIXED: ClassVar[tuple[str, ...]] = ("changed", "is_timed", "on_event", "on_sent", "store", "variant")
    __slots__ = (
        *FIXED,
        "_due",
        "_edges",
        "_rst_high_since",
        "_waveform",
        "address",
        "events",
        "image",
        "interface",
        "io",
        "is_shut_down",
        "memory",
        "motor",
        "now",
        "program",
        "receiver",
        "uart",
        "unit",
    )

    def __init__(
        self,
        variant: Variant = DEFAULT,
        *,
        address: int = OPEN_ADDRESS,
        interface: Interface = STEP_DIRECTION,
        baud: int | None = None,
        statement_ns: Nanos | None = None,
        is_timed: bool = False,
        image: bytes = b"",
    ) -> None:
        if not 0 <= address <= OPEN_ADDRESS:
            raise Misuse(WRONG_ADDRESS(address=address, most=OPEN_ADDRESS))
        if statement_ns is not None and statement_ns < 0:
            raise Misuse(NEGATIVE_STATEMENT_TIME(statement_ns=statement_ns))
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
        self.changed: Callable[[], None] = lambda: None
        self.now: Nanos = 0
        self._due: Nanos | None = None
        self._waveform = 1
        """The characteristic of the phase currents that was reported last."""
        self._rst_high_since: Nanos | None = None
        self._find_deadline()

    @property
    def axes(self) -> tuple[ChipDrive]:
        """The one axis, as `steptwin.motioncontroller.MotionController` has it."""
        return (self.motor.drive,)

    @property
    def drive(self) -> ChipDrive:
        return self.motor.drive

    # ------------------------------------------------------------------ time

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        due = self._due
        while due is not None and due <= now:
            self._run_instant(due, now)
            due = self._due
        self.now = now

    def advance_to_change(self, until: Nanos) -> Nanos:
        """See `steptwin.motioncontroller.MotionController.advance_to_change`."""
        due = self._due
        if due is None or due > until:
            self.advance(until)
        else:
            self._run_instant(due, until)
            self.advance(self.now)
        return self.now

    def _run_instant(self, at: Nanos, until: Nanos) -> None:
        """Execute one deadline at ``at``. A received character comes after everything else, so that the splitting of input does
        not matter."""
        self.now = at
        if self.is_shut_down:
            self._end_shutdown(at)
        elif not self._run_hardware(at):
            due = self.program.deadline(at)
            if due is not None and due <= at:
                self._run_program(at, until)
            elif (byte := self.uart.arrived(at)) is not None:
                self.receiver.character(byte, at)
        self._find_deadline()

    def _run_hardware(self, at: Nanos) -> bool:
        due = self.motor.deadline()
        if due is not None and due <= at:
            self.motor.ended(at)
            self.receiver.compress(at)
            return True
        due = self.receiver.busy_until
        if due is not None and due <= at:
            self.receiver.eeprom_done(at)
            return True
        has_left = self.uart.leave(at)
        if has_left and self.on_sent is not None:
            self.on_sent()
        return has_left

    def _run_program(self, at: Nanos, until: Nanos) -> None:
        """Run the program until the next other deadline; a single command if the receiver may depend on it."""
        if self.receiver.is_stalled:
            until = at
        due = self._hardware_deadline()
        self.now = self.program.run(at, until if due is None else max(at, min(until, due - 1)))
        self.receiver.compress(self.now)

    def _hardware_deadline(self) -> Nanos | None:
        deadlines = (self.motor.deadline(), self.receiver.busy_until, self.uart.arrival(), self.uart.departure())
        return min((due for due in deadlines if due is not None), default=None)

    def deadline(self) -> Nanos | None:
        return self._due

    def _find_deadline(self) -> None:
        """Compute the next deadline after a change of state."""
        if self.is_shut_down:
            since = self._rst_high_since
            self._due = None if since is None else since + SHUTDOWN_RESET_NS
        else:
            due, other = self._hardware_deadline(), self.program.deadline(self.now)
            self._due = other if due is None else due if other is None else min(due, other)
            if self._due is None and self.program.ready > self.now:
                self._due = self.program.ready  # the end of the last command, since when it is idle
        self.changed()

    def _propagate(self) -> None:
        """Execute the consequences of an input at this moment."""
        self._find_deadline()
        self.advance(self.now)

    def is_busy(self, now: Nanos) -> bool:
        """Whether a motion, a command or a program is in progress at ``now``, to which it has come; one that is held is not."""
        if self.drive.is_busy:
            return True
        at_work = self.program.ready > now or not self.program.is_at_end
        return not self.program.is_held and (at_work or self._hardware_deadline() is not None or self.receiver.is_stalled)

    def is_idle(self) -> bool:
        """Whether nothing is in progress or pending; a program that is held or waits for a line is not idle."""
        at_work = self.program.ready > self.now or not self.program.is_at_end
        hardware = self._hardware_deadline() is not None or self.receiver.is_stalled
        return not (at_work or hardware or self.program.is_held)

    # ------------------------------------------------------------------ the serial port

    def receive(self, data: bytes, now: Nanos) -> None:
        """Characters from the host begin at ``now``."""
        self.advance(now)
        if self.is_shut_down:
            return
        self.uart.receive(data, now)
        self._propagate()

    def halt(self, now: Nanos) -> None:
        """A stop of its world: the motor goes down its ramp, and nothing else of what it was given before is executed.

        As wrong data and Kill in one burst that overtakes what is on the line, in the input buffer and in an EEPROM. It works
        with function 44 ON, too, and with 51 OFF it does not hold the commands behind it. A file that is being received does not
        run.
        """
        self.advance(now)
        if self.is_shut_down:
            return
        self.receiver.discard(self.uart.take_arriving(), now)
        if self.memory.file is FileState.OPEN:
            self.memory.refuse_file()
        elif self.memory.file is FileState.CLOSED:
            self.memory.enable()  # what an EEPROM is being written with is passed over, too
        self.motor.kill(now)
        self.program.abandon(now)
        self.program.is_killed = False
        self._propagate()

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        """Characters that have left by ``now``, each with the moment of its end."""
        self.advance(now)
        return [(moment, bytes((byte,))) for moment, byte in self.uart.take_sent()]

    # ------------------------------------------------------------------ pins

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        """Pull a pin low (0) or let it go high (1) from outside: B1–B21, JOG, LIMIT, SD, RST, S&D, DUAL."""
        name = settable_pin(pin, value)
        if now > self.now:  # at the beginning, lines have their levels before the first command
            self.advance(now)
        level = int(value)
        if name in LINE_PINS:
            self.io.set_external(LINE_PINS[name], level, now)
        elif self.io[name] != level:
            self.io.others[name] = level
            self._control_changed(name, level, now)
        self._propagate()

    def _control_changed(self, name: str, level: int, now: Nanos) -> None:
        if name == "RST":
            self._rst_changed(level, now)
        elif self.is_shut_down:
            return
        elif name == "SD":
            if not level and self.variant.has_shutdown:
                self._shut_down(now)
        elif name == "LIMIT":
            self.motor.limit_changed(level, now)
        elif name == "JOG" and not level:
            self.motor.jog(now)

    def pins(self) -> Mapping[str, float]:
        return {name: self.pin(name) for name in (*LINE_PINS, *self.io.others, WAVEFORM)}

    def pin(self, name: str) -> float:
        line = LINE_PINS.get(name)
        if line is not None:
            return float(self.level(line, self.now))
        return float(self.drive.characteristic if name == WAVEFORM else self.io.others[name])

    def take_edges(self) -> list[PinEdge]:
        waveform = self.motor.drive.characteristic
        if waveform != self._waveform:
            self._waveform = waveform
            self._edges.append(PinEdge(self.now, WAVEFORM, float(waveform)))
        edges, self._edges = self._edges, []
        return edges

    # ------------------------------------------------------------------ power, RST, shutdown

    def power_off(self, now: Nanos) -> None:
        """Switch off: until a `power_cycle` the chip neither acts nor receives nor sends."""
        self.advance(now)
        self._fall_silent(now)
        self.io.release_outputs(now)
        self._propagate()

    def power_cycle(self, now: Nanos) -> None:
        """Switch off and on again. Pins stay tied as they are, and the motor stays where it is."""
        self.advance(now)
        self._awake()
        self.event("power-on", POWER_ON(), now)
        self._read_pins()
        self._start_anew(now)
        self._propagate()

    def _start_anew(self, now: Nanos) -> None:
        """Defaults; an E type runs its stored file. M-30: with all address pins low it is only reset, and keeps the file."""
        self.receiver.reset()
        self.set_defaults(now)
        if self.variant.store is Store.EEPROM and self.address != 0:
            self._run_stored_file(now)

    def _run_stored_file(self, now: Nanos) -> None:
        file = unpack(self.image, self.variant)
        if file is not None:
            self.memory.load(file)
            self.program.restart(self.memory.begin, now)

    def _read_pins(self) -> None:
        self.address = self.io.address()
        self.uart.set_baud(self.variant.baud(*self.io.baud_pins()))

    def _rst_changed(self, level: int, now: Nanos) -> None:
        self._rst_high_since = now if level else None
        if level and not self.is_shut_down:
            self._read_pins()
            if self.address == 0:
                self.event("reset", RESET_BY_RST(), now)
                self._start_anew(now)
            else:
                self.event("restart", RESTART_BY_RST(), now)
                self._restart(now)

    def _restart(self, now: Nanos) -> None:
        """The program in memory begins again (an E type's stored file); settings and position stay (M-23)."""
        self.motor.stop_at_once(now)
        self.receiver.reset()
        if self.variant.store is Store.EEPROM:
            self.memory.reset()
            self._run_stored_file(now)
        else:
            if self.memory.file is not FileState.CLOSED:
                self.memory.drop_file()
            self.program.restart(self.memory.begin, now)

    def _shut_down(self, now: Nanos) -> None:
        self.event("shutdown", SHUTDOWN(), now)
        self._fall_silent(now)
        if not self.unit.on(OUTPUTS):
            self.io.tie_low(True, now)

    def _fall_silent(self, now: Nanos) -> None:
        self.motor.stop_at_once(now)
        self.uart.clear()
        self.is_shut_down = True
        self.motor.drive.is_energised = False
        self._rst_high_since = None

    def _awake(self) -> None:
        self.is_shut_down = False
        self.motor.drive.is_energised = True

    def _end_shutdown(self, now: Nanos) -> None:
        """RST has been high for long enough. The address pins are not read; M-31: the program begins again, as with RST."""
        self._rst_high_since = None
        if not self.io["SD"]:
            return
        self._awake()
        self.event("restart", SHUTDOWN_IS_OVER(), now)
        self.io.tie_low(False, now)
        self.uart.set_baud(self.variant.baud(*self.io.baud_pins()))
        self._restart(now)

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
            raise WrongData(LINE_OF_AN_INTERFACE(line=line, interface=self.interface.title))

    def put_out(self, lines: range, bits: int, now: Nanos) -> None:
        """Set outputs, lowest line = least significant bit. Raises `WrongData` if the interface uses one (M-21)."""
        for line in lines:
            self.refuse_occupied(line)
        for bit, line in enumerate(lines):
            level = bits >> bit & 1
            if self.io.latches[line] != level:
                self.event("output", (OUTPUT_HIGH if level else OUTPUT_LOW)(line=line), now, ("line", line), ("level", level))
                self.io.set_latch(line, level, now)

    def switch(self, function: int, on: bool, now: Nanos) -> None:
        """T and C of a function."""
        self.unit.switch(function, on)
        if function == RUNSIGN:
            self.motor.show_runsign(now)
        elif function in (LIMITOFF, EDGE, RECOVER):
            self.motor.look_at_limit(now)

    def upload(self, number: int, byte: int, now: Nanos) -> None:
        self.event("upload", BYTE_IS_SENT(number=number, byte=byte), now, ("command", number), ("byte", byte))
        self.send(byte, now)

    def event(self, code: str, text: str, now: Nanos, *facts: Fact) -> None:
        event = M1486Event(now, code, text, facts)
        self.events.append(event)
        if self.on_event is not None:
            self.on_event(event)

    def wrong_data(self, what: str, now: Nanos) -> None:
        """Drop a command and stop the program, unless function 44 is ON (M-11)."""
        stops = not self.unit.on(CONTINUE)
        text = (WRONG_DATA_STOPS if stops else WRONG_DATA)(what=text_of(what))
        self.event("wrong-data", text, now, ("why", str(what)), ("stops", stops))
        if stops:
            self.program.abandon(now)

    # ------------------------------------------------------------------ interface to the receiver

    def wrong_data_received(self, what: str, now: Nanos) -> None:
        """As `wrong_data`; a file that is being received does not run then."""
        self.wrong_data(what, now)
        if self.memory.file is FileState.OPEN and not self.unit.on(CONTINUE):
            self.memory.refuse_file()

    def kill(self, now: Nanos) -> None:
        self.event("kill", KILL(), now)
        self.motor.kill(now)

    def clear_kill(self, now: Nanos) -> None:
        self.event("clear-kill", CLEAR_KILL(), now)
        self.program.is_killed = False

    def close_file(self, now: Nanos) -> None:
        """``]``: the file runs, and an E type keeps it."""
        file = self.memory.close_file()
        if file is None:
            return
        self.event("file", FILE(size=8 * len(file.code)), now, ("size", 8 * len(file.code)))
        if self.variant.store is Store.EEPROM:
            self._keep(pack(file), now)  # M-37: nothing else is kept

    def software_reset(self, now: Nanos) -> None:
        """``\\``: defaults; an E type erases its EEPROM. Address and baud rate stay."""
        self.event("reset", RESET(), now)
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
                self.event("store-failed", EEPROM_IS_NOT_KEPT(why=error), now, ("why", str(error)))
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

    # ------------------------------------------------------------------ snapshots

    def snapshot(self) -> ChipSnapshot:
        """All state at the present moment; hooks are not part of it."""
        return ChipSnapshot(self.variant, self.is_timed, self.program.statement_ns, self.copy_state())

    def restore(self, snapshot: ChipSnapshot) -> None:
        """Take the state of a snapshot, its moment too. Raises `Misuse` when it belongs to another kind of chip."""
        belongs = (snapshot.variant, snapshot.is_timed, snapshot.statement_ns)
        if belongs != (self.variant, self.is_timed, self.program.statement_ns):
            raise Misuse(SNAPSHOT_OF_ANOTHER_CHIP(title=snapshot.variant.title, own=self.variant.title))
        self.set_state(snapshot.state)
        self.changed()

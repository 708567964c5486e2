"""M1486 chips on one serial line: what `steptwin serve m1486` and `steptwin run` put together."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Any, NamedTuple

from steptwin.errors import Misuse
from steptwin.files.memory import StateDirectory
from steptwin.live.cell import Cell
from steptwin.live.control import changes
from steptwin.live.links import Feed
from steptwin.m1486.chip import EVENTS_KEPT, M1486, OPEN_ADDRESS
from steptwin.m1486.chip import Event as ChipEvent
from steptwin.m1486.line import LinePort, SerialChain
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.m1486.pins import LINE_PINS, known_pin
from steptwin.m1486.variants import DEFAULT, Store, Variant
from steptwin.machine import Event, Nanos, Port
from steptwin.served.faults import FaultDesk
from steptwin.words.characters import CharacterLog, LineSplitter
from steptwin.words.m1486_state import state_of
from steptwin.world.faults import FaultyTalkingPort, Line, M1486Body
from steptwin.world.kernel import Kernel, PinName, Wire

_WIRE = re.compile(r"\s*([0-9A-Fa-f])\.([^.=]+)=\s*([0-9A-Fa-f])\.([^.=]+)\Z")


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainOptions:
    """How the chips of a line are made and tied. ``baud`` None: the highest that their pins choose."""

    variant: Variant = DEFAULT
    addresses: Sequence[int] = (OPEN_ADDRESS,)
    interface: Interface = STEP_DIRECTION
    baud: int | None = None
    is_timed: bool = False
    is_written_down: bool = False
    """Whether what goes over the line is put into words."""
    wires: Sequence[Wire] = ()


class M1486Line:
    """Chips with different addresses on one line, their EEPROMs, and what a person can ask of them.

    ``image`` is the stored file of the only chip; in the EEPROM of an E type it takes the place of what ``state`` has.
    Raises `Misuse`, `StateFailure` where the state directory cannot be read.
    """

    def __init__(self, options: ChainOptions, *, state: StateDirectory | None = None, image: bytes | None = None) -> None:
        self.options = options
        self.variant = variant = options.variant
        self.frames = CharacterLog(variant)
        self._sinks: list[Callable[[int, ChipEvent], None]] = []
        self._untold: deque[tuple[int, ChipEvent]] = deque(maxlen=EVENTS_KEPT)
        """What happened before there was a sink: a stored file runs as soon as there is power."""
        self.kernel = Kernel()
        self.chips = make_chips(options, state, image)
        for address, chip in self.chips.items():
            chip.on_event = partial(self._happened, address)
            self.kernel.add(chip_name(address), chip)
        for wire in options.wires:
            self.kernel.connect(wire)
        self.faults = FaultDesk(self.kernel, {chip_name(a): partial(M1486Body, chip) for a, chip in self.chips.items()})
        self.faults.lines = {Line.CHARACTERS}
        self.chain = SerialChain(self.chips.values())
        self.baud = self.present_baud()
        names = ", ".join(map(chip_name, self.chips))
        addresses = f"addresses {names}" if len(self.chips) > 1 else f"address {names}"
        self.title = f"{variant.title}, {options.interface.title}, {addresses}, {self.baud} bit/s"
        self._connections = count(1)

    # ------------------------------------------------------------------ ports

    def port(self, link: str) -> Port:
        """A place on the line for one more program."""
        port = ProgramPort(self.chain.port(), LineSplitter(self.frames, link) if self.options.is_written_down else None)
        return FaultyTalkingPort(port, link, self.faults.faults, Line.CHARACTERS)

    def client_port(self) -> Port:
        """A place on the line for one more client of raw TCP."""
        return self.port(f"tcp-{next(self._connections)}")

    def present_baud(self) -> int:
        """That of the first chip, bit/s: RST and power-up read the pins anew."""
        return next(iter(self.chips.values())).uart.baud

    def log_characters(self, cell: Cell) -> Feed:
        """From now on what the chips send goes into the log of characters, until the feed is closed."""
        port = ListeningPort(self.chain.port(), self.frames)
        return Feed(cell, port, port)

    # ------------------------------------------------------------------ events

    def _happened(self, address: int, event: ChipEvent) -> None:
        if event.code == "upload" and self.options.is_written_down:
            self.frames.upload(event)
        if not self._sinks:
            self._untold.append((address, event))
        for sink in self._sinks:
            sink(address, event)

    def watch_events(self, sink: Callable[[int, ChipEvent], None]) -> None:
        """Tell ``sink`` address and event; the first one also what happened before."""
        self._sinks.append(sink)
        for address, event in self._untold:
            sink(address, event)
        self._untold.clear()

    def told(self, unit: int, event: Event) -> str:
        """An event in words; the chip is named where there are several."""
        return f"chip {chip_name(self.chips[unit].address)}: {event.text}" if len(self.chips) > 1 else event.text

    # ------------------------------------------------------------------ control requests

    def handlers(self, cell: Cell) -> dict[str, Callable[[Mapping[str, Any]], object]]:
        """Requests of the control endpoint; ``unit``, an address, chooses the chip where there are several.

        Power comes to all of them together unless one is chosen.
        """

        def acting(action: Callable[[Mapping[str, Any], Nanos], object]) -> Callable[[Mapping[str, Any]], object]:
            def handle(request: Mapping[str, Any]) -> object:
                now = cell.enter()
                try:
                    return action(request, now)
                finally:
                    cell.leave()

            return handle

        return {
            "pin": acting(self._pin),
            "power-cycle": acting(self._power_cycle),
            "state": acting(lambda request, now: state_of(self._chosen(request), now)),
            "fault": self.faults.handler(cell),
        }

    def _pin(self, request: Mapping[str, Any], now: Nanos) -> object:
        """All changes or none, then every pin. A hand reaches the pins before a switch that is stuck, not behind it."""
        chip = self._chosen(request)
        terminals = next(self.kernel.machines[chip_name(address)] for address, one in self.chips.items() if one is chip)
        changes = _pin_changes(request)
        for pin, _ in changes:
            refuse_taken(pin, chip.interface)
        for pin, level in changes:
            terminals.set_pin(pin, level, now)
        return dict(chip.pins())

    def _power_cycle(self, request: Mapping[str, Any], now: Nanos) -> None:
        for chip in self.chips.values() if request.get("unit") is None else (self._chosen(request),):
            chip.power_cycle(now)

    def _chosen(self, request: Mapping[str, Any]) -> M1486:
        """The chip that has the address now: address pins are read anew by RST and power-up."""
        unit = request.get("unit")
        chips = list(self.chips.values())
        if unit is None and len(chips) == 1:
            return chips[0]
        served = ", ".join(chip_name(chip.address) for chip in chips)
        if unit is None:
            raise Misuse(f"several chips are served: choose one with --unit: {served}")
        address: object = unit
        if isinstance(unit, str):
            with suppress(ValueError):
                address = int(unit, 16)
        chosen = [chip for chip in chips if chip.address == address and not isinstance(address, bool)]
        if len(chosen) != 1:
            raise Misuse(f"{f'several chips have address {unit}' if chosen else f'no chip {unit}'}: served are {served}")
        return chosen[0]


def make_chips(options: ChainOptions, state: StateDirectory | None = None, image: bytes | None = None) -> dict[int, M1486]:
    """The chips of a line by address, each with its EEPROM."""
    variant = options.variant
    for wire in options.wires:
        for end in (wire.source, wire.target):
            refuse_taken(end.pin, options.interface, f"--wire {wire.source}={wire.target}: ")
    if image is not None and len(options.addresses) > 1:
        raise Misuse(f"a program to switch on with is for a single chip: here are {len(options.addresses)}")
    chips: dict[int, M1486] = {}
    for address in options.addresses:
        if address not in variant.addresses:
            raise Misuse(
                f"address {address:X}: {variant.title} takes {variant.addresses[0]:X} to {variant.addresses[-1]:X}"
                " (with all address pins low it is reset instead of running its file)"
            )
        if variant.store is Store.EEPROM and state is not None:
            name = memory_name(address)
            if image is not None:
                state.save(name, image)
            chips[address] = _chip(options, address, state.load(name) or b"", f"{state.path}, {name}: ")
            chips[address].store = partial(state.save, name)
        else:
            chips[address] = _chip(options, address, image or b"")
    return chips


def _chip(options: ChainOptions, address: int, image: bytes, whence: str = "") -> M1486:
    try:
        return M1486(
            options.variant,
            address=address,
            interface=options.interface,
            baud=options.baud,
            is_timed=options.is_timed,
            image=image,
        )
    except Misuse as misuse:
        raise Misuse(f"{whence if image else ''}{misuse}") from None


def chip_name(address: int) -> str:
    """The name of a chip among the machines of a world: its address as ``X`` takes it."""
    return f"{address:X}"


def memory_name(address: int) -> str:
    return f"m1486-{address:X}-eeprom"


# ---------------------------------------------------------------------- options as people write them


def parse_addresses(text: str) -> list[int]:
    """``0,7`` → addresses, hexadecimal digits. Raises `Misuse`."""
    addresses: list[int] = []
    for part in text.split(","):
        digit = part.strip().upper()
        if len(digit) != 1 or digit not in "0123456789ABCDEF":
            raise Misuse(f"--chain {text}: {digit!r} is no address; permitted are 0 to 9 and A to F, separated by commas")
        if int(digit, 16) in addresses:
            raise Misuse(f"--chain {text}: {digit} is given twice")
        addresses.append(int(digit, 16))
    return addresses


def parse_wire(text: str) -> Wire:
    """``0.B1=7.B3`` → a wire from a pin of one chip to an input of another. Raises `Misuse`."""
    match = _WIRE.match(text)
    if match is None:
        raise Misuse(f"--wire {text}: expected FROM=TO with chips by address, such as 0.B1=7.B3")
    source = match[2].strip().upper()
    with suppress(Misuse):  # outputs that are no inputs are for the kernel to know
        source = known_pin(source)
    return Wire(PinName(match[1].upper(), source), PinName(match[3].upper(), known_pin(match[4])))


def refuse_taken(pin: str, interface: Interface, place: str = "") -> None:
    """`Misuse` for a line whose pin the driver interface has: it is no input and no output (M-21)."""
    if LINE_PINS.get(pin) in interface.occupied:
        taken = interface.occupied
        lines = f"B{taken[0]} to B{taken[-1]}"
        raise Misuse(f"{place}{pin} is taken: the {interface.title} interface has {lines}")


class PinChange(NamedTuple):
    pin: str
    level: int


def pin_change(pin: str, value: object) -> PinChange:
    """A change of an input that `M1486.set_pin` will take. Raises `Misuse`."""
    name = known_pin(pin)
    if not isinstance(value, int | float):
        raise Misuse(f"{name} = {value!r}: a pin takes a number")
    if value not in (0, 1):
        raise Misuse(f"{name} = {value:g}: a digital input is 0 or 1")
    return PinChange(name, int(value))


def _pin_changes(request: Mapping[str, Any]) -> list[PinChange]:
    return [pin_change(pin, value) for pin, value in changes(request).items()]


# ---------------------------------------------------------------------- places on the line


class ProgramPort:
    """One program's place on the line; its typing is written down where somebody wants that.

    It needs no timer of its own: characters leave the chips at deadlines of theirs, and ``on_output`` is called then.
    """

    broken = None

    def __init__(self, port: LinePort, typed: LineSplitter | None) -> None:
        self._port = port
        self._typed = typed

    @property
    def on_output(self) -> Callable[[], None] | None:
        return self._port.on_output

    @on_output.setter
    def on_output(self, call: Callable[[], None] | None) -> None:
        self._port.on_output = call

    def exchange(self, data: bytes, now: Nanos) -> bytes:
        if self._typed is not None:
            self._typed.take(data, now)
        return self._port.exchange(data, now)

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        return self._port.to_send(now)

    def deadline(self) -> Nanos | None:
        return None

    def close(self) -> None:
        self._port.close()


class ListeningPort(ProgramPort):
    """Writes down what the chips send; a feed that carries it has nothing to write."""

    def __init__(self, port: LinePort, log: CharacterLog) -> None:
        super().__init__(port, None)
        self._log = log

    def to_send(self, now: Nanos) -> list[tuple[Nanos, bytes]]:
        for moment, data in super().to_send(now):
            for byte in data:
                self._log.sent(moment, byte)
        return []

    def write(self, data: bytes) -> None:
        """Nobody hears it."""

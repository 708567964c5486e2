"""A driver of the toy, and what programs need of it: `TOY_DRIVER`. It moves and is read; it has no drives, no jog and no home."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

from steptwin.drivers.kind import (
    AddressSelection,
    DeviceAddress,
    DeviceMotion,
    DeviceOverview,
    DeviceSearch,
    DriverKind,
    EndedMotion,
    FoundDevice,
    Log,
    ReadValue,
    ReadValues,
    WantedMoves,
)
from steptwin.drivers.kinds import DRIVERS, register
from steptwin.drivers.lineaddress import parse_line_address
from steptwin.drivers.tcp import Channel
from steptwin.errors import LineFailure, Misuse, Refusal
from toy.controller import STEP_P

PATIENCE_S = 5.0
BAUD = 9600
UNIT = "pulse"


class ToyDriver:
    """Two bytes go out, two come back. Positions in pulses."""

    def __init__(self, place: str, channel: Channel) -> None:
        self.place = place
        self._channel = channel

    def ask(self, letter: str, number: int = 0) -> int:
        """Raises `Refusal`, and `LineFailure` without an answer."""
        self._channel.write(letter.encode() + number.to_bytes(signed=True))
        answer = b""
        while len(answer) < 2:
            data = self._channel.read(PATIENCE_S)
            if not data:
                raise LineFailure(f"{self.place}: no answer to {letter} {number}")
            answer += data
        if answer[:1] == b"E":
            raise Refusal(f"{self.place}: the toy refuses {letter} {number}")
        return int.from_bytes(answer[1:], signed=True)

    def position(self) -> int:
        return STEP_P * self.ask("P")


class ToyTerminal:
    """``M 10``, ``P 0``, ``H 0``."""

    greeting = "a toy"
    prompt = "toy> "
    help = "M NUMBER, P 0, H 0"
    names = ("M", "P", "H")

    def __init__(self, opened: AbstractContextManager[ToyDriver]) -> None:
        self._opened = opened
        self._toy = self._opened.__enter__()

    def greet(self) -> None:
        """It is open."""

    def is_stop(self, line: str) -> bool:
        return line.startswith("H")

    def answer(self, line: str, *, waits: bool) -> Iterator[str]:
        letter, _, number = line.partition(" ")
        yield f"{letter} {self._toy.ask(letter, int(number))}"

    def close(self) -> None:
        self._opened.__exit__(None, None, None)


class ToySearch(DeviceSearch):
    bauds = (BAUD,)
    numbers = 1
    title = "toy"
    form = "d"
    disturbs = False

    def find(
        self, place: str, baud: int, numbers: Sequence[int], timeout_s: float, progress: Callable[[int], object]
    ) -> Sequence[FoundDevice]:
        channel = parse_line_address(place, baud).endpoint.open()
        try:
            channel.write(b"P\0")
            return [FoundDevice(1, None, "a toy")] if channel.read(timeout_s)[:1] == b"P" else []
        finally:
            channel.close()


class ToyDriverKind(DriverKind[ToyDriver]):
    name = "toy"
    title = "a toy"
    axes = 1
    selection = AddressSelection(option="toy", variant="series", forms="toy=1")
    baud = BAUD
    timeout_s = PATIENCE_S
    usual = ("POSITION",)
    search = ToySearch()
    programs = (".toy",)
    cannot_send = "a toy has no memory"

    @contextmanager
    def opened(self, address: DeviceAddress, observe: bool, log: Log | None) -> Generator[ToyDriver]:
        channel = parse_line_address(address.place, address.baud).endpoint.open()
        try:
            yield ToyDriver(address.place, channel)
        finally:
            channel.close()

    def info(self, driver: ToyDriver, address: DeviceAddress) -> DeviceOverview:
        position = driver.position()
        head = [f"toy at {driver.place}"]
        return DeviceOverview({"device": driver.place, "position": position}, head, [("position", position, UNIT)])

    def names(self) -> Sequence[str]:
        return ("POSITION",)

    def reading(self, names: Sequence[str]) -> Callable[[ToyDriver], ReadValues]:
        for name in names:
            if name.upper() != "POSITION":
                raise Misuse(f"{name!r} is not a value of a toy: permitted is POSITION")
        return lambda toy: {"POSITION": ReadValue(toy.position(), UNIT)}

    def followed(self, names: Sequence[str], variant: str | None) -> Sequence[str]:
        return names or ("position",)

    def writing(self, changes: Sequence[str]) -> Callable[[ToyDriver], ReadValues]:
        raise Misuse(f"{changes[0]!r}: nothing of a toy can be set")

    def stop(self, address: DeviceAddress, log: Log | None, axes: Collection[int], program: bool) -> str | None:
        with self.opened(address, True, log) as toy:
            toy.ask("H")
        return "a toy has no program" if program else None

    def move(self, moves: WantedMoves) -> DeviceMotion[ToyDriver]:
        ((axis, target),) = moves.targets.items()

        def begin(toy: ToyDriver, begun: set[int], check: Callable[[], object]) -> None:
            way, rest = divmod(target - (0 if moves.is_by else toy.position()), STEP_P)
            if rest or moves.velocity is not None:
                raise Misuse(f"{target:g}: a toy moves by multiples of {STEP_P} pulses, at its own velocity")
            check()
            toy.ask("M", int(way))
            begun.add(axis)

        return DeviceMotion((axis,), begin)

    def wait(self, driver: ToyDriver, axes: Collection[int], timeout_s: float | None) -> Sequence[EndedMotion]:
        """It rests when it takes a move by nothing."""
        begin = time.monotonic()
        while True:
            after_s = time.monotonic() - begin
            try:
                driver.ask("M", 0)
            except Refusal:
                if after_s <= (PATIENCE_S if timeout_s is None else timeout_s):
                    time.sleep(0.01)
                    continue
                return [EndedMotion(1, "toy", False, "not done yet", None, UNIT, after_s, is_overdue=True)]
            return [EndedMotion(1, "toy", True, "at rest", driver.position(), UNIT, after_s)]

    def halt(self, driver: ToyDriver, axes: Collection[int]) -> None:
        driver.ask("H")

    def terminal(self, address: DeviceAddress, show: Callable[[str], object], log: Log | None) -> ToyTerminal:
        return ToyTerminal(self.opened(address, True, log))


TOY_DRIVER = ToyDriverKind()


@contextmanager
def registered_driver() -> Generator[None]:
    """Addresses may have toys meanwhile."""
    register(TOY_DRIVER)
    try:
        yield
    finally:
        del DRIVERS[TOY_DRIVER.name]

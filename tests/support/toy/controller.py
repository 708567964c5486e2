"""The toy itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from steptwin.controller import Nanos, PinEdge
from steptwin.errors import Misuse, TimeReversal
from steptwin.motion import MotionState, Profile, at_rest, plan_position, plan_stop
from steptwin.motioncontroller import Drive
from steptwin.state import Plain, Stateful

STEP_P = 10
"""Pulses per unit of the number in a command."""
ACCELERATION_P = 1000.0
VELOCITY_P = 500.0


def _nothing() -> None:
    pass


class Bare(Stateful):
    """A motion controller without axes, pins or anything to do: a base for small machines."""

    FIXED: ClassVar[tuple[str, ...]] = ("changed",)
    __slots__ = (*FIXED, "edges", "now")

    def __init__(self) -> None:
        self.changed: Callable[[], None] = _nothing
        self.now: Nanos = 0
        self.edges: list[PinEdge] = []

    @property
    def axes(self) -> Sequence[Drive]:
        return ()

    def advance(self, now: Nanos) -> None:
        if now < self.now:
            raise TimeReversal(self.now, now)
        self.now = now

    def advance_to_change(self, until: Nanos) -> Nanos:
        due = self.deadline()
        moment = until if due is None else min(due, until)
        self.advance(moment)
        return moment

    def deadline(self) -> Nanos | None:
        return None

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        raise Misuse(f"no pin {pin!r}")

    def pins(self) -> Mapping[str, float]:
        return {}

    def pin(self, name: str) -> float:
        return self.pins()[name]

    def take_edges(self) -> list[PinEdge]:
        edges, self.edges = self.edges, []
        return edges

    def power_off(self, now: Nanos) -> None:
        self.advance(now)

    def power_cycle(self, now: Nanos) -> None:
        self.advance(now)

    def snapshot(self) -> Plain:
        return self.copy_state()

    def restore(self, snapshot: Plain) -> None:
        self.set_state(snapshot)
        self.changed()


class ToyAxis(Stateful):
    FIXED: ClassVar[tuple[str, ...]] = ("revision",)
    __slots__ = (*FIXED, "is_energised", "plan")
    offset_p = 0

    def __init__(self) -> None:
        self.plan: Profile = at_rest(0, 0)
        self.revision = 0
        self.is_energised = True

    def follow(self, plan: Profile) -> None:
        self.plan = plan
        self.revision += 1


class Driven(Bare):
    """A machine whose only axis goes where the test says."""

    __slots__ = ("axis",)

    def __init__(self) -> None:
        super().__init__()
        self.axis = ToyAxis()

    @property
    def axes(self) -> tuple[ToyAxis]:
        return (self.axis,)

    def go(self, target: int, now: Nanos) -> None:
        self.axis.follow(plan_position(MotionState.of(self.axis.plan, now), target, 500.0, 500.0, 200.0))
        self.changed()


class Toy(Bare):
    """BUSY is high while the axis moves; STOP high stops it with a ramp and keeps it from starting."""

    __slots__ = ("axis", "is_busy", "is_off", "stop", "taken")

    def __init__(self) -> None:
        super().__init__()
        self.axis = ToyAxis()
        self.is_busy = False
        self.is_off = False
        self.stop = False
        self.taken = 0

    @property
    def axes(self) -> tuple[ToyAxis]:
        return (self.axis,)

    def advance(self, now: Nanos) -> None:
        due = self.deadline()
        if due is not None and due <= now:
            super().advance(due)
            self._show(False)
            self.changed()
        super().advance(now)

    def deadline(self) -> Nanos | None:
        return self.axis.plan.end if self.is_busy else None

    # ------------------------------------------------------------------ pins

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        if pin != "STOP" or value not in (0.0, 1.0):
            raise Misuse(f"{pin} = {value:g}: the input is STOP, 0 or 1")
        self.advance(now)
        self.stop = value == 1.0
        if self.stop:
            self.halt(now)
        self.changed()

    def pins(self) -> Mapping[str, float]:
        return {name: self.pin(name) for name in ("STOP", "BUSY")}

    def pin(self, name: str) -> float:
        return float(self.stop if name == "STOP" else self.is_busy)

    def _show(self, is_busy: bool) -> None:
        if is_busy is not self.is_busy:
            self.is_busy = is_busy
            self.edges.append(PinEdge(self.now, "BUSY", float(is_busy)))

    # ------------------------------------------------------------------ commands

    def execute(self, command: bytes, now: Nanos) -> bytes:
        """``M`` n moves by n·`STEP_P` pulses, ``H`` 0 halts, ``P`` 0 asks for the position in `STEP_P`; refused: ``E``."""
        self.advance(now)
        self.taken += 1
        letter, number = command[:1], int.from_bytes(command[1:], signed=True)
        if letter == b"M" and not (self.is_busy or self.stop or self.is_off):
            there = self.axis.plan.count(now)
            self._go(
                plan_position(
                    MotionState.of(self.axis.plan, now), there + STEP_P * number, ACCELERATION_P, ACCELERATION_P, VELOCITY_P
                ),
                now,
            )
        elif letter == b"H":
            self.halt(now)
        elif letter == b"P":
            number = self.axis.plan.count(now) // STEP_P
        else:
            letter = b"E"
        return letter + (number & 0xFF).to_bytes()

    def halt(self, now: Nanos) -> None:
        if self.is_busy:
            self._go(plan_stop(MotionState.of(self.axis.plan, now), ACCELERATION_P), now)

    def _go(self, plan: Profile, now: Nanos) -> None:
        self.axis.follow(plan)
        self._show(plan.moving(now))
        self.changed()

    # ------------------------------------------------------------------ supply

    def power_off(self, now: Nanos) -> None:
        self.advance(now)
        self.is_off = True
        self.axis.follow(at_rest(now, self.axis.plan.count(now)))
        self._show(False)
        self.changed()

    def power_cycle(self, now: Nanos) -> None:
        self.power_off(now)
        self.is_off = False

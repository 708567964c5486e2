"""The contract of a controller with the wires at its pins, mechanics, faults and snapshots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from steptwin.controller import Controller, Nanos, PinEdge
from steptwin.motion.divisions import Plan


class Drive(Protocol):
    """An axis of a controller, as its motion is followed."""

    @property
    def plan(self) -> Plan:
        """The source of its pulses, from now on."""
        ...

    @property
    def revision(self) -> int:
        """Counts replacements of ``plan``."""
        ...

    @property
    def is_energised(self) -> bool:
        """Whether its motor has current. A change is followed by `MotionController.changed`."""
        ...

    @property
    def offset_p(self) -> int:
        """The position that the controller shows, less the pulses counted since power-on; 0 where it is not traced."""
        ...


class MotionController(Controller, Protocol):
    """A controller with named pins and axes: the interface of a controller to scheduler, mechanics, faults and snapshots.

    Inputs take timestamped changes, outputs give timestamped edges. STEP is never an edge: it stays a plan of its axis.
    """

    changed: Callable[[], None]
    """Hook: called whenever the next deadline, an output or a plan may have changed."""

    @property
    def now(self) -> Nanos:
        """The moment that it has reached."""
        ...

    @property
    def axes(self) -> Sequence[Drive]:
        """The drives, the same objects throughout."""
        ...

    def advance_to_change(self, until: Nanos) -> Nanos:
        """Advance to the first moment at which an output, a plan or anything else outside a program may have changed, or to
        ``until``; returns that moment.

        Nothing may come in before ``until``: a program that only calculates may have been executed up to there already. Where
        nothing but the next deadline has changed, `changed` need not be called.
        """
        ...

    def set_pin(self, pin: str, value: float, now: Nanos) -> None:
        """Apply an input change after everything that happens at ``now``. Unknown names raise with the permitted ones."""
        ...

    def pins(self) -> Mapping[str, float]:
        """Present value of every pin, inputs and outputs."""
        ...

    def pin(self, name: str) -> float:
        """Present value of one of `pins`."""
        ...

    def take_edges(self) -> list[PinEdge]:
        """Output edges since the last call, in order."""
        ...

    def power_off(self, now: Nanos) -> None:
        """Drives and outputs off. Until `power_cycle` no request or character is given to the controller."""
        ...

    def power_cycle(self, now: Nanos) -> None:
        """Switch off and on again, as after power-on; shafts, the levels at its inputs and stored memory stay as they are."""
        ...

    def snapshot(self) -> Any:
        """All state at the present moment, hooks excepted; it is immutable and can be pickled."""
        ...

    def restore(self, snapshot: Any) -> None:
        """Take the state of a snapshot, its moment too. `steptwin.errors.Misuse` when it is of a different controller."""
        ...

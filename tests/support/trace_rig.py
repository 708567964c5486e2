"""Traces of real runs for tests of what reads them: a MIC488 with four axes homing, moving, running into limits; an M1486."""

from __future__ import annotations

from typing import NamedTuple

from mic488_rig import EN, OUT, STOP, Rig

from steptwin.files.export import AxisLane, axis_views, controller_views
from steptwin.files.world import World
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.machine import Nanos
from steptwin.mic488.config import AxisConfig, ControllerConfig
from steptwin.mic488.core import Mic488Event
from steptwin.world.kinds import MIC488
from steptwin.world.small import Whole, m1486_world
from steptwin.world.trace import Trace, TraceRecord

SPINDLES = ControllerConfig(
    axes=tuple(
        AxisConfig(unit=3, gear=100.0, acc=50.0, dec=50.0, vel=25.0, home_mode=1, limit_mode=3, in_kl=axis, in_kr=axis + 4)
        for axis in range(4)
    )
)
"""Millimetres; KL on IN1-IN4, KR on IN5-IN8; homing backs off the switch."""


class TracedRig(Rig):
    """A `Rig` that writes down what happens: plans, edges of all pins, frames, events."""

    def __init__(self) -> None:
        super().__init__(SPINDLES)
        self.trace = Trace(["m"])
        self._levels: dict[str, float] = {}
        self._revisions = [-1] * 4
        self._events: list[Mic488Event] = []
        self.device.on_event = self._events.append
        for axis in range(1, 5):
            self.switch(axis, None, -1000, f"IN{axis}")
            self.switch(axis, 6000, None, f"IN{axis + 4}")
        self._look()

    def _look(self) -> None:
        now = self.kernel.now
        for n, axis in enumerate(self.device.axes):
            if axis.revision != self._revisions[n]:
                self._revisions[n] = axis.revision
                self._note(now, "plan", str(n + 1), axis.profile)
        levels = dict(self.device.pins())
        for pin, level in levels.items():
            if self._levels.get(pin) != level and (self._levels or level):
                self._note(now, "edge", pin, level)
        self._levels = levels
        for event in self._events:
            self._note(now, "event", event.code, event.text)
        self._events.clear()

    def _note(self, time: Nanos, kind: str, subject: str, value: object) -> None:
        self.trace.add(TraceRecord(time, "m", kind, subject, value))

    def wait_ns(self, nanoseconds: int) -> None:
        end = self.now + nanoseconds
        while (due := self.kernel.deadline()) is not None and due <= end:
            super().wait_ns(due - self.now)
            self._look()
        super().wait_ns(end - self.now)

    def pin(self, pin: str, value: float) -> None:
        super().pin(pin, value)
        self._note(self.now, "input", "pin", f"{pin} = {value:g}")
        self._look()

    def ask(self, pdu: bytes) -> bytes:
        self._note(self.now, "frame", "tcp-1/in", pdu)
        response = super().ask(pdu)
        self._look()
        self._note(self.now, "frame", "tcp-1/out", response)
        return response


class Run(NamedTuple):
    trace: Trace
    views: dict[tuple[str, str], AxisLane]
    until: Nanos


def mic488_run() -> Run:
    """18 s: all axes home, M1 and M2 go back and forth, M3 runs into its switch, M4 is stopped; outputs and an analog input."""
    rig = TracedRig()
    rig.wait(0.25)
    for axis in range(4):
        rig.coil(EN + axis, True)
        rig.set("HOME", (-12.0, -20.0, -16.0, -9.0)[axis], axis + 1)
    rig.wait(5.0)
    for turn in range(3):
        rig.coil(OUT + turn, True)
        rig.set("POS_ABS", (40.0, 8.0, 25.0)[turn], 1)
        rig.wait(0.15)
        rig.set("POS_ABS", (30.0, 55.0, 2.5)[turn], 2)
        if turn == 1:
            rig.set("VEL_ABS", 24.0, 3)
            rig.set("VEL_ABS", -15.0, 4)
        for sample in range(14):
            rig.pin("AIN1", round(5.0 + 4.5 * (sample % 7 - 3) / 3, 3))
            rig.wait(0.25)
            rig.position(1 + sample % 4)
        rig.coil(OUT + turn, False)
    rig.coil(STOP + 3, True)
    rig.pin("IN20", 1.0)
    rig.wait(0.4)
    rig.pin("IN20", 0.0)
    rig.wait(1.0)
    return Run(rig.trace, controller_views("m", MIC488, rig.device), rig.now)


M1486_PROGRAM = (
    "m8", "q1", "s200", "a5000", "v4000", "n2",
    "f64000", "r", "c9", "b19200", "r", "t9", "n1", "v1000", "h", "r",
)  # fmt: skip


def m1486_run(interface: Interface = STEP_DIRECTION) -> Run:
    """An indexer goes 1000 steps forward, changing its microstep in flight, 300 back, and home."""
    text = m1486_world(Whole(name="i"), [15], {"interface": interface.name, "variant": "A"}, typed=M1486_PROGRAM)
    world = World.from_toml(text.replace("chipF", "i"))
    while (due := world.due()) is not None:
        world.run_to(due)
    return Run(world.trace, dict(axis_views(world)), world.now)

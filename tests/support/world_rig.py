"""Worlds for tests: three controllers, one with an axis and a button (`small`); runs to export (`mic488_run`, `m1486_run`); a
check that a world can be restored."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent
from typing import NamedTuple

from mic488_rig import EN, OFFSETS, OUT, STOP, VALUES, coil_pdu, real_words, words_pdu

from steptwin.controller import Nanos
from steptwin.files.export import AxisChannel, axis_views
from steptwin.files.recording import load, recording_of, save
from steptwin.files.world import World
from steptwin.m1486.lines import STEP_DIRECTION, Interface
from steptwin.simulation.describe.generated import LINE, Whole
from steptwin.simulation.describe.generated_m1486 import m1486_world
from steptwin.simulation.describe.generated_mic488 import mic488_world
from steptwin.simulation.scheduler.trace import Trace
from steptwin.simulation.world.inputs import Bytes

TWO_LINES = """
    [[line]]
    name = "bus"
    tcp = "127.0.0.1:0"
    [[line]]
    name = "chips"
    kind = "m1486"
    tcp = "127.0.0.1:0"
"""
SMALL = """
    [world]
    seed = 3
    [[mic488]]
    name = "a"
    [mic488.M1]
    unit = "mm"
    gear = 100.0
    acc = 100.0
    dec = 100.0
    vel = 40.0
    in_kl = "IN1"
    home_mode = "HOME1"
    limit_mode = "KL"
    [[mic488]]
    name = "b"
    [[mic488]]
    name = "c"
    [[axis]]
    name = "x"
    drive = "a.M1"
    travel = [-1.0, 101.0]
    start = 50.0
    [[axis.switch]]
    below = 0.0
    to = "a.IN1"
    hysteresis = 0.2
    [[wire]]
    from = "a.OUT1"
    to = "b.IN3"
    delay = "20 ms"
    [[button]]
    name = "go"
    to = "b.IN4"
"""


def small(more: str = "") -> World:
    return World.from_toml(dedent(SMALL) + dedent(more))


def check_it_can_be_restored(world: World, other: World, moment_s: float, end_s: float, folder: Path) -> None:
    """From a snapshot of a moment and from a recording, all goes on as it did. ``other``: a new world of the same description."""
    world.run(until=moment_s)
    snapshot = world.snapshot()
    world.run(until=end_s)
    other.restore(snapshot)
    other.run(until=end_s)
    assert other.trace.digest() == world.trace.digest()
    save(recording_of(world), folder / "s.json")
    assert load(folder / "s.json").replay().trace.digest() == world.trace.digest()


def moved(world: World, position: float) -> World:
    axis = world.mic488["a"].axis[1]
    axis.enable()
    axis.move_to(position)
    return world


# ---------------------------------------------------------------------- runs


class Run(NamedTuple):
    trace: Trace
    views: dict[tuple[str, str], AxisChannel]
    until: Nanos

    def origin_p(self, axis: str, now: Nanos) -> int:
        """By how many pulses the coordinate of an axis is above its count since power-on, straight from the trace."""
        records = [record for record in self.trace.of("coordinate") if record.subject == axis and record.time <= now]
        return int(str(records[-1].value)) if records else 0


def _run_of(world: World) -> Run:
    return Run(world.trace, dict(axis_views(world)), world.now)


def mic488_run() -> Run:
    """18 s of the demo's spindles, the controller called ``m``.

    All axes home, M1 and M2 go back and forth, M3 runs into its switch at 60 mm, M4 is stopped; outputs and an analog input.
    """
    text = mic488_world(Whole(name="m", line={"tcp": "127.0.0.1:0"}), [None], {}, demo=True)
    world = World.from_toml(text.replace('"mic488', '"m').replace("above = 250.0", "above = 60.0"))
    controller, line = world.mic488["m"], world.line[LINE]

    def ask(pdu: bytes) -> None:
        world.apply_input(Bytes(LINE, "tcp-1", "tcp", b"\0\1\0\0" + (len(pdu) + 1).to_bytes(2, "big") + b"\1" + pdu))
        assert line.received("tcp-1")[7] == pdu[0]

    def put(key: str, value: float, axis: int) -> None:
        ask(words_pdu(OFFSETS["1.70"] + VALUES[key] + 2 * (axis - 1), *real_words(value)))

    world.run(for_=0.25)
    for axis in range(4):
        ask(coil_pdu(EN + axis, True))
        put("HOME", (-12.0, -20.0, -16.0, -9.0)[axis], axis + 1)
    world.run(for_=5.0)
    for turn in range(3):
        ask(coil_pdu(OUT + turn, True))
        put("POS_ABS", (40.0, 8.0, 25.0)[turn], 1)
        world.run(for_=0.15)
        put("POS_ABS", (30.0, 55.0, 2.5)[turn], 2)
        if turn == 1:
            put("VEL_ABS", 24.0, 3)
            put("VEL_ABS", -15.0, 4)
        for sample in range(14):
            controller.set_pin("AIN1", round(5.0 + 4.5 * (sample % 7 - 3) / 3, 3))
            world.run(for_=0.25)
        ask(coil_pdu(OUT + turn, False))
    ask(coil_pdu(STOP + 3, True))
    controller.set_pin("IN20", 1.0)
    world.run(for_=0.4)
    controller.set_pin("IN20", 0.0)
    world.run(for_=1.0)
    return _run_of(world)


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
    return _run_of(world)

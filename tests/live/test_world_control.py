"""A live world as a subject: commands come at the present moment, and what they lead to happens."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from steptwin.controller import SECOND
from steptwin.errors import Misuse
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.live.clock import Clock
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.script import steps as do
from steptwin.subject import commands as command
from steptwin.subject.subscriptions import filter_of

Run = Callable[..., Any]
EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"


class Rig:
    """A live world in the virtual time of the loop."""

    def __init__(self) -> None:
        loop = asyncio.get_running_loop()
        self.world = World.load(EXAMPLES / "feeder.toml")
        self.live = LiveWorld(self.world)
        self.realtime = RealTimeDriver(self.live, Clock(wall_ns=lambda: round(loop.time() * SECOND)))
        self.pace = Pace(self.live, self.realtime, lambda _: None, has_clients=True)
        self.control = WorldControl(self.realtime, self.live, self.pace, lambda: ["here"])
        self.pace.begin(1.0)


def scene(run: Run, play: Callable[[Rig], Awaitable[None]]) -> None:
    async def played() -> None:
        rig = Rig()
        await play(rig)
        rig.realtime.close()
        recording = recording_of(rig.world)
        assert recording.replay().trace.digest() == recording.digest

    run(played())


def test_a_command_is_done_at_the_present_moment_and_recorded(run: Run) -> None:
    async def play(rig: Rig) -> None:
        await asyncio.sleep(2)
        done = rig.control.do(do.Set((("table", "IN7", 1.0),)))
        assert done.time == 2 * SECOND
        assert rig.control.do(command.ReadPins("table")).value["table.IN7"] == 1.0
        rig.control.do(do.PowerCycle("table"))
        rig.control.do(do.Turn("table", 2, 12))
        assert rig.control.do(command.Encoders("table")).value[1] == {"axis": 2, "counts": 12, "turned_by": "drive"}
        assert rig.control.do(command.ReadState("drum")).value["kind"] == "m1486"
        assert rig.control.do(do.SetFault(read_fault("busy unit=1"))).value == {"name": "busy"}
        rig.control.do(do.ClearFault("busy"))
        assert rig.control.do(command.ListFaults()).value == []
        assert rig.control.do(command.EndPoints()).value == ["here"]
        assert len(rig.world.inputs) == 5

    scene(run, play)


def test_time_is_the_present_while_a_world_goes_on(run: Run) -> None:
    async def play(rig: Rig) -> None:
        await asyncio.sleep(0.3)
        assert rig.control.do(command.Time()).value["time_ns"] == "300000000"
        await asyncio.sleep(0.1)
        assert rig.control.read("time")[0].value == 0.4
        rig.control.do(command.Pause())
        await asyncio.sleep(0.5)
        found = rig.control.do(command.Time()).value
        assert (found["time_s"], found["paused"], found["speed"]) == (0.4, True, 1.0)

    scene(run, play)


def test_who_follows_is_told_how_time_goes(run: Run) -> None:
    async def play(rig: Rig) -> None:
        subscription = rig.control.subscribe(filter_of(["pace"]), 9)
        await asyncio.sleep(1)
        rig.control.do(command.Resume(2.0))
        rig.control.do(command.Pause())
        rig.control.do(command.Resume())
        events = subscription.take().events
        assert [event.text for event in events] == [
            "running, 2 virtual seconds per second",
            "paused",
            "running, 2 virtual seconds per second",
        ]
        assert [event.time for event in events] == [SECOND] * 3

    scene(run, play)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        (command.ReadState("drumm"), r"no controller is called 'drumm' \(did you mean 'drum'\?\); there are table, drum"),
        (do.SetFault(read_fault("stuck machine=table pin=table.IN3")), r"name the controller as machine=NAME, and the pin alone"),
        (do.SetFault(read_fault("stall machine=table axis=9")), "axis = 9: permitted are 1 to 4"),
        (do.Press("strat"), "no button is called 'strat'"),
        (command.Encoders("drum"), "'drum' is an M1486, which has no encoder"),
        (command.Resume(float("inf")), "has lines with external clients, which need real time"),
    ],
)
def test_what_cannot_be_done_is_refused_and_leaves_no_input(run: Run, wanted: command.Command, message: str) -> None:
    async def play(rig: Rig) -> None:
        with pytest.raises(Misuse, match=message):
            rig.control.do(wanted)
        assert rig.world.inputs == []

    scene(run, play)

"""The debugger of a world that goes on in real time, in the virtual time of the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import Misuse, Refusal
from steptwin.files.recording import recording_of
from steptwin.files.world import World
from steptwin.live import debugging as module
from steptwin.live.clock import Clock
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.world import ClientPort, LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.simulation.world import snapshotlog
from steptwin.subject.commands import read_command
from steptwin.subject.events import Event
from steptwin.subject.subscriptions import filter_of

Run = Callable[..., Any]

PROGRAM = b"""n = 0
MAIN:
    n = n + 1
    JUMP PART
    DELAY 0.1
    CFGINT_IN3 = RIS
JUMP MAIN

PART:
    OUT2 = ON
    OUT2 = OFF
RETURN

INT_IN3:
    OUT3 = ON
    OUT4 = ON
RETURN
"""
TEXT = '[[mic488]]\nname = "table"\nprogram = "count.prg"\nstart = true\n'


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow this machine is now."""
    monkeypatch.setattr(module, "PART_S", 3600.0)


class Rig:
    """A live world in the virtual time of the loop, with a client that follows its debugger."""

    def __init__(self, text: str = TEXT, program: bytes = PROGRAM, *, records: bool = True) -> None:
        loop = asyncio.get_running_loop()
        self.world = World.from_toml(text, {"count.prg": program}, keep_trace=records, keep_inputs=records)
        if not records:
            self.world.stop_recording()
        self.notices: list[str] = []
        self.live = LiveWorld(self.world, self.notices.append)
        self.realtime = RealTimeDriver(self.live, Clock(wall_ns=lambda: round(loop.time() * SECOND)))
        self.pace = Pace(self.live, self.realtime, lambda _: None, has_clients=True)
        self.control = WorldControl(self.realtime, self.live, self.pace, lambda: ["here"])
        self.subscription = self.control.subscribe(filter_of(["stopped", "log"]), 1000)
        self.pace.begin(1.0)

    def do(self, what: str, /, **fields: object) -> Any:
        return self.control.do(read_command(what, fields)).value

    def line(self, **fields: object) -> Any:
        return self.do("breakpoint", controller="table", program="program 0", **fields)

    async def event(self) -> Event:
        """The next one."""
        came = asyncio.Event()
        self.subscription.on_event = came.set
        if not len(self.subscription):
            await came.wait()
        return self.subscription.take(1).events[0]

    async def stop(self) -> tuple[str, object]:
        payload: Any = (await self.event()).payload
        assert payload.kind == "stopped"
        return payload.reason, payload.line

    def value(self, expression: str) -> float:
        return self.do("evaluate", controller="table", expression=expression)["number"]


def scene(run: Run, play: Callable[[Rig], Awaitable[None]]) -> None:
    async def played() -> None:
        rig = Rig()
        await play(rig)
        rig.subscription.close()
        assert rig.live.run_control is None
        rig.pace.close()
        rig.realtime.close()
        recording = recording_of(rig.world)
        assert recording.replay().trace.digest() == recording.digest

    run(played())


def test_time_stops_before_the_line_of_a_breakpoint_and_goes_on(run: Run) -> None:
    async def play(rig: Rig) -> None:
        await asyncio.sleep(1)
        assert rig.line(line=9)["line"] == 10
        assert await rig.stop() == ("breakpoint", 10)
        assert rig.pace.is_paused
        assert rig.do("pins", controller="table")["table.OUT2"] == 0
        stack = rig.do("stack", controller="table")
        assert [(frame["name"], frame["line"]) for frame in stack[:2]] == [("PART", 10), ("MAIN", 5)]
        count, now = rig.value("n"), rig.world.now
        assert count > 5
        await asyncio.sleep(5)
        assert rig.world.now == now
        rig.do("resume")
        assert await rig.stop() == ("breakpoint", 10)
        assert rig.value("n") == count + 1
        assert 100 * MILLISECOND < rig.world.now - now < 110 * MILLISECOND

    scene(run, play)


def test_steps_take_as_long_as_their_statements(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=4)
        assert await rig.stop() == ("breakpoint", 4)
        loop = asyncio.get_running_loop()
        rig.do("step_program", controller="table", way="over")
        assert await rig.stop() == ("step", 5)
        begun = loop.time()
        rig.do("step_program", controller="table", way="over")
        assert await rig.stop() == ("step", 6)
        assert loop.time() - begun >= 0.1
        for line in (7, 3, 4):
            rig.do("step_program", controller="table", way="over")
            assert (await rig.stop())[1] == line
        rig.do("step_program", controller="table", way="in")
        assert await rig.stop() == ("step", 10)
        rig.do("step_program", controller="table", way="out")
        assert await rig.stop() == ("step", 5)

    scene(run, play)


def test_the_past_can_be_looked_at_and_gone_on_from(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=3)
        for _ in range(4):
            assert await rig.stop() == ("breakpoint", 3)
            rig.do("resume")
        assert await rig.stop() == ("breakpoint", 3)
        there, count = rig.world.now, rig.value("n")
        rig.do("step_program", controller="table", way="back")
        assert await rig.stop() == ("step", 7)
        place = rig.do("debug")
        assert place["past"]
        assert place["present_ns"] == str(there)
        rig.do("run", way="backwards")
        assert await rig.stop() == ("breakpoint", 3)
        assert rig.value("n") == count - 1
        with pytest.raises(Misuse, match="branch"):
            rig.do("set_value", controller="table", name="n", expression="7")
        rig.do("run")
        assert await rig.stop() == ("breakpoint", 3)
        assert not rig.do("debug")["past"]
        assert rig.world.now == there
        rig.do("run", way="backwards")
        await rig.stop()
        rig.do("run")
        await rig.stop()
        rig.do("run")
        assert await rig.stop() == ("breakpoint", 3)
        assert rig.world.now > there
        assert rig.value("n") == count + 1

    scene(run, play)


def test_a_branch_takes_the_world_back(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=3)
        await rig.stop()
        rig.do("resume")
        await rig.stop()
        rig.do("run", way="backwards")
        await rig.stop()
        then = int(rig.do("debug")["time_ns"])
        rig.do("branch")
        assert await rig.stop() == ("pause", None)
        assert rig.world.now == then
        rig.do("set_value", controller="table", name="n", expression="40 + 2")
        rig.do("resume")
        await rig.stop()
        assert rig.value("n") == 43

    scene(run, play)


def test_the_past_begins_where_debugging_began(run: Run) -> None:
    async def play(rig: Rig) -> None:
        await asyncio.sleep(3)
        rig.line(line=3)
        await rig.stop()
        rig.do("clear_breakpoint", breakpoint=1)
        rig.do("run", way="backwards")
        payload: Any = (await rig.event()).payload
        assert (payload.reason, payload.what) == ("begin", "no older moment is kept")
        assert rig.do("debug")["begin_ns"] == rig.do("debug")["time_ns"] == str(3 * SECOND)
        with pytest.raises(Misuse, match="the past is kept from 3 s"):
            rig.do("look_at", to_ns="2999999999")

    scene(run, play)


def test_inputs_from_outside_are_seen(run: Run) -> None:
    async def play(rig: Rig) -> None:
        watch = rig.do("breakpoint", controller="table", value="IN3")["number"]
        label = rig.do("breakpoint", label="INT_IN3")["number"]
        await asyncio.sleep(0.5)
        rig.do("set", levels={"table.IN3": 1})
        hits = []
        for _ in range(2):
            event = await rig.event()
            payload: Any = event.payload
            hits.append((payload.reason, payload.breakpoints))
            assert rig.world.now <= 511 * MILLISECOND, "the input has a filter of 10 ms"
            rig.do("resume")
        assert sorted(hits) == [("data breakpoint", (watch,)), ("function breakpoint", (label,))]

    scene(run, play)


def test_a_client_that_was_connected_before_the_debugger_is_seen(run: Run) -> None:
    """Its requests start a program, end a WAIT and change what the past is run again with, in a twin that keeps nothing."""

    async def play() -> None:
        text = '[[line]]\nname = "bus"\ntcp = "127.0.0.1:0"\n[[mic488]]\nname = "table"\nline = "bus"\nprogram = "count.prg"\n'
        rig = Rig(text, b"A:\nOUT1 = ON\nWAIT $I0 = 1\nOUT2 = ON\nDELAY 0.1\nJUMP A\n", records=False)
        port = ClientPort(rig.live, "bus", "tcp-1", "tcp")

        def ask(pdu: str) -> bytes:
            rig.realtime.enter()
            answer = port.exchange(bytes.fromhex(f"00 01 00 00 00 06 01 {pdu}"), rig.live.now)
            rig.realtime.leave()
            return answer

        for _ in range(3):
            assert ask("02 1388 0001")[7:] == bytes.fromhex("02 01 00")
        await asyncio.sleep(0.3)
        rig.line(line=2)
        rig.line(line=4)
        for _ in range(3):
            await asyncio.sleep(0.2)
            ask("06 2713 0001")
            assert await asyncio.wait_for(rig.stop(), 5) == ("breakpoint", 2)
            rig.do("resume")
            await asyncio.sleep(0.2)
            ask("06 0000 0001")
            assert await asyncio.wait_for(rig.stop(), 5) == ("breakpoint", 4)
            rig.do("resume")
            ask("06 2713 0000")
            ask("06 0000 0000")
        await asyncio.sleep(0.2)
        rig.subscription.close()
        rig.pace.close()
        rig.realtime.close()

    run(play())


def test_a_step_of_time_ends_at_a_breakpoint(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.do("pause")
        rig.line(line=3)
        await asyncio.sleep(0.1)
        rig.subscription.take()
        answer = rig.do("step", for_ns="10000000000")
        assert not answer["came"]
        assert (await rig.stop()) == ("breakpoint", 3)
        assert rig.world.now < 200 * MILLISECOND
        rig.do("clear_breakpoint", breakpoint=1)
        rig.do("step", for_ns="1000000000")
        assert (await rig.stop()) == ("pause", None)

    scene(run, play)


def test_logs_and_conditions(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=3, log="n is {n}")
        rig.line(line=5, condition="n = 3")
        first: Any = (await rig.event()).payload
        assert (first.words, first.line) == ("n is 0", 3)
        assert [(await rig.event()).payload.text for _ in range(2)] == [
            "program 0, line 3: n is 1",
            "program 0, line 3: n is 2",
        ]
        assert await rig.stop() == ("breakpoint", 5)
        assert rig.value("n") == 3

    scene(run, play)


def test_whoever_does_not_follow_is_not_stopped_for(run: Run) -> None:
    async def play(rig: Rig) -> None:
        number = rig.line(line=3)["number"]
        await rig.stop()
        rig.subscription.close()
        assert rig.notices == ["the debugger has disconnected and time is paused: 'steptwin resume' continues it"]
        rig.do("resume")
        await asyncio.sleep(3)
        assert not rig.pace.is_paused
        with pytest.raises(Refusal, match="subscribe to events of kind 'stopped'"):
            rig.do("debug")
        assert [one["number"] for one in rig.do("breakpoints")["breakpoints"]] == [number]
        rig.subscription = rig.control.subscribe(filter_of(["stopped"]), 10)
        rig.do("debug")
        assert await rig.stop() == ("breakpoint", 3)

    scene(run, play)


def test_what_cannot_be_is_refused(run: Run) -> None:
    async def play(rig: Rig) -> None:
        for fields, message in (
            ({"line": 3, "label": "MAIN"}, "one of line, label and value"),
            ({"line": 3, "controller": "table"}, "line needs program"),
            ({"label": "MAIN", "log": "x"}, "label takes no log"),
            ({"value": "n", "controller": "nobody"}, "'nobody' has no program: table has one"),
            ({"value": "table.OUT99", "controller": "table"}, "no signal 'table.OUT99'"),
            ({"value": "nobody.x", "controller": "table"}, "'nobody.x' means nothing"),
            ({"label": "NOWHERE"}, "no label is called 'NOWHERE'"),
            ({"line": 99, "controller": "table", "program": "program 0"}, "no statement is in line 99"),
            ({"line": 3, "controller": "table", "program": "program 7"}, "no text 'program 7'"),
        ):
            with pytest.raises(Misuse, match=message):
                rig.do("breakpoint", **fields)
        assert rig.do("breakpoints") == {"breakpoints": [], "stop_on": [], "stop": None}
        with pytest.raises(Refusal, match="the world is running"):
            rig.do("step_program", controller="table", way="in")
        with pytest.raises(Misuse, match="no breakpoint 5"):
            rig.do("clear_breakpoint", breakpoint=5)
        rig.do("pause")
        with pytest.raises(Refusal, match="at the present"):
            rig.do("branch")

    scene(run, play)


def test_a_condition_without_a_finite_value_stops_and_the_world_goes_on(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=3, condition="9e190 * 9e190 % 2 = 1")
        assert await rig.stop() == ("breakpoint", 3)
        for do, fields in (("evaluate", {}), ("set_value", {"name": "n"})):
            with pytest.raises(Misuse, match="a number up to"):
                rig.do(do, controller="table", expression="1e400", **fields)
        rig.do("clear_breakpoint", breakpoint=1)
        rig.do("resume")
        now = rig.world.now
        await asyncio.sleep(1)
        rig.do("pause")
        assert rig.world.now >= now + SECOND

    scene(run, play)


def test_another_speed_does_not_pass_over_a_breakpoint(run: Run) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=3)
        await rig.stop()
        rig.do("resume")
        rig.realtime.close()  # as in an event loop that is late
        await asyncio.sleep(0.3)
        assert rig.do("resume", speed=2.0)["paused"]
        assert await rig.stop() == ("breakpoint", 3)
        assert rig.value("n") == 1

    scene(run, play)


def test_more_inputs_than_are_kept_while_time_stands(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(rig: Rig) -> None:
        rig.line(line=3)
        await rig.stop()
        rig.do("resume")
        await rig.stop()
        monkeypatch.setattr(snapshotlog, "MOST_INPUTS", 50)
        for number in range(200):
            rig.do("set", levels={"table.IN5": number % 2})
        rig.do("resume")
        assert await rig.stop() == ("breakpoint", 3)
        assert rig.value("n") == 2

    scene(run, play)


def test_a_world_without_programs_does_not_keep_its_past(run: Run) -> None:
    async def play() -> None:
        rig = Rig('[[mic488]]\nname = "table"\n')
        for _ in range(3):
            with pytest.raises(Misuse, match="no controller has a program"):
                rig.do("debug")
        assert rig.live.snapshots is None
        assert not rig.world.input_subscribers
        rig.pace.close()
        rig.realtime.close()

    run(play())


def test_a_breakpoint_of_two_clients_stays_until_both_have_removed_it(run: Run) -> None:
    async def play(rig: Rig) -> None:
        assert rig.line(line=3) == rig.line(line=3)
        rig.do("clear_breakpoint", breakpoint=1)
        assert [one["number"] for one in rig.do("breakpoints")["breakpoints"]] == [1]
        rig.do("clear_breakpoint", breakpoint=1)
        assert rig.do("breakpoints")["breakpoints"] == []

    scene(run, play)


def test_followers_are_told_what_time_stops_at_where_that_changes(run: Run) -> None:
    async def play(rig: Rig) -> None:
        told = rig.control.subscribe(filter_of(["breakpoints"]), 1000)
        number = rig.line(line=9)["number"]
        rig.line(line=9)
        rig.do("stop_on", events=["limit"])
        rig.do("stop_on", events=["limit"])
        with pytest.raises(Misuse):
            rig.line(line=99)
        for _ in range(2):
            rig.do("clear_breakpoint", breakpoint=number)
        seen: list[Any] = [event.payload.to_json() for event in told.take().events]
        assert [([one["line"] for one in state["breakpoints"]], state["stop_on"]) for state in seen] == [
            ([10], []),
            ([10], ["limit"]),
            ([], ["limit"]),
        ]
        told.close()

    scene(run, play)

"""The time of a live world in somebody's hands, in virtual time: what is done to it is seen by nobody inside."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from world_rig import TWO_LINES

from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.errors import Misuse, Refusal
from steptwin.files.recording import load, recording_of
from steptwin.files.world import World
from steptwin.files.worldoptions import WorldRunOptions
from steptwin.live import pace as pacing
from steptwin.live.clock import Clock
from steptwin.live.links import Feed
from steptwin.live.options import LiveOptions, UpOptions
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.running import ClientPort, LiveWorld, up
from steptwin.live.world_control import WorldControl
from steptwin.subject.commands import read_command
from steptwin.wire.crc import with_crc

Run = Callable[..., Any]

EXAMPLES = Path(__file__).parents[2] / "examples" / "worlds"
READ_POSITION = bytes.fromhex("01 03 27 24 00 02 8e b4")
CLOCKLESS = """
    [[mic488]]
    name = "a"
    [[script]]
    name = "ticks"
    repeat = 1000
    steps = [{ wait = "1 s" }, { note = "tick" }]
    [[event]]
    when = "a.IN1"
    steps = [{ set = { "a.IN2" = 1 } }]
"""


@pytest.fixture(autouse=True)
def steps_have_one_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow this machine is now."""
    monkeypatch.setattr(pacing, "PART_NS", 3600 * SECOND)


class Rig:
    """A live world in the virtual time of the loop; ``do`` is what the control endpoint does."""

    def __init__(self, world: World, speed: float = 1.0, *, has_clients: bool = True) -> None:
        loop = asyncio.get_running_loop()
        self.live = LiveWorld(world)
        self.world = world
        self.realtime = RealTimeDriver(self.live, Clock(wall_ns=lambda: round(loop.time() * SECOND), begin=world.now))
        self.lags: list[Nanos] = []
        self.realtime.on_lag = self.lags.append
        self.told: list[str] = []
        self.pace = Pace(self.live, self.realtime, self.told.append, has_clients=has_clients)
        self.control = WorldControl(self.realtime, self.live, self.pace, list)
        self.pace.begin(speed)

    def do(self, what: str, **request: object) -> Any:
        """The answer to a message; moments in it as numbers."""
        answer = json.loads(json.dumps(self.control.do(read_command(what, request)).value))
        if not isinstance(answer, dict):
            return answer
        return {name: int(value) if name.endswith("_ns") else value for name, value in answer.items()}

    def close(self) -> World:
        self.realtime.enter()
        self.realtime.close()
        self.pace.close()
        return self.world


def told(events: list[dict[str, Any]]) -> list[tuple[str, str]]:
    return [(event["controller"], event["text"]) for event in events]


def feeder() -> World:
    return World.load(EXAMPLES / "feeder.toml")


def the_same_again(world: World) -> bool:
    recording = recording_of(world)
    again = recording.replay()
    return again.trace.digest() == recording.digest and list(again.trace) == list(world.trace)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    deeds=st.lists(
        st.one_of(
            st.tuples(st.just("wall"), st.integers(1, 900)),
            st.tuples(st.just("pause"), st.none()),
            st.tuples(st.just("resume"), st.sampled_from([None, 0.1, 1, 50])),
            st.tuples(st.just("step"), st.sampled_from([0, 1, MILLISECOND, 2 * SECOND, None])),
            st.tuples(st.just("until"), st.sampled_from(["x.position < 110", "table.M1.moving", "drum.counter > 100"])),
            st.tuples(st.just("client"), st.sampled_from(["bus", "chips"])),
            st.tuples(st.just("set"), st.sampled_from(["table.IN8", "table.IN9"])),
            st.tuples(st.sampled_from(["press", "release"]), st.just("start")),
        ),
        max_size=16,
    )
)
def test_whatever_is_done_to_the_pace_a_session_replays(run: Run, deeds: list[tuple[str, Any]]) -> None:
    async def scene() -> World:
        rig = Rig(feeder())
        ports = {"bus": ClientPort(rig.live, "bus", "tcp-1", "rtu"), "chips": ClientPort(rig.live, "chips", "raw-1", "raw")}
        for number, (what, how) in enumerate(deeds):
            before = rig.live.now
            if what == "wall":
                await asyncio.sleep(how / 1000)
            elif what == "step":
                while "to_ns" in (answer := rig.do("step", **({} if how is None else {"for_ns": how}))):
                    pass
                assert how is None or answer["time_ns"] - before >= how
            elif what == "until":
                rig.do("step", until=how, for_ns=3 * SECOND)
            elif what == "client":
                ports[how].exchange({"bus": READ_POSITION, "chips": b"x3\rf640\rr\r"}[how], rig.realtime.enter())
                rig.realtime.leave()
            elif what == "set":
                rig.do("set", levels={how: number % 2})
            elif what in ("press", "release"):
                rig.do(what, button=how)
            else:
                rig.do(what, **({} if how is None else {"speed": how}))
        return rig.close()

    assert the_same_again(run(scene()))


def test_a_world_stands_while_it_is_paused_and_goes_on_from_there(run: Run) -> None:
    async def scene() -> None:
        rig = Rig(feeder(), 2.0)
        await asyncio.sleep(1.5)
        assert rig.do("pause") == {
            "world": "bar feeder",
            "time_ns": 3 * SECOND,
            "time_s": 3.0,
            "paused": True,
            "speed": 2.0,
            "stopped": None,
        }
        await asyncio.sleep(100)
        assert rig.do("pause")["time_ns"] == 3 * SECOND
        assert rig.do("state", controller="table")["time_s"] == 3.0
        assert rig.do("resume")["paused"] is False
        await asyncio.sleep(1)
        assert rig.do("resume", speed=10) == {**rig.do("resume"), "time_s": 5.0, "speed": 10.0}
        await asyncio.sleep(1)
        assert rig.do("pause")["time_s"] == 15.0
        assert rig.lags == []
        assert [line.split(maxsplit=3)[3] for line in rig.told] == [
            "running, 2 virtual seconds per second",
            "paused",
            "running, 2 virtual seconds per second",
            "running, 10 virtual seconds per second",
            "paused",
        ]
        assert the_same_again(rig.close())

    run(scene())


def test_what_was_planned_before_a_pause_comes_after_it(run: Run) -> None:
    async def scene() -> None:
        rig = Rig(World.from_toml(CLOCKLESS))
        ticks: list[tuple[float, Nanos]] = []
        loop = asyncio.get_running_loop()
        rig.world.trace.subscribers.append(lambda record: ticks.append((round(loop.time(), 6), record.time)))
        await asyncio.sleep(0.5)
        rig.do("pause")
        await asyncio.sleep(5)
        rig.do("resume", speed=0.5)
        await asyncio.sleep(3.5)
        rig.close()
        assert ticks == [(6.5, SECOND), (8.5, 2 * SECOND)]
        assert rig.lags == []

    run(scene())


def test_steps_end_at_a_time_a_condition_or_what_happens_next(run: Run) -> None:
    async def scene() -> None:
        rig = Rig(feeder(), 0.0)
        assert rig.do("step", for_ns=250)["time_ns"] == 250
        crossing = World.load(EXAMPLES / "feeder.toml")
        crossing.run(until="x.position < 100")
        answer = rig.do("step", until="x.position < 100")
        assert (answer["time_ns"], answer["came"]) == (crossing.now, True)
        assert rig.do("step", until="x.position < 100")["time_ns"] == crossing.now
        vain = rig.do("step", until="x.position > 300", for_ns=MILLISECOND)
        assert (vain["time_ns"], vain["came"]) == (crossing.now + MILLISECOND, False)
        rig.do("step", until="drum.moving")
        happened = rig.do("step", for_ns=SECOND)["events"]
        assert told(happened) == [("table", "start: released"), ("drum", "stands at 12800")]
        twin = rig.world.branch()
        answer = rig.do("step")
        assert answer["time_ns"] == twin.step()
        assert told(answer["events"]) == [("table", "AIN1: 4.382")]
        await asyncio.sleep(10)
        assert rig.do("pause")["time_ns"] == twin.now
        assert rig.lags == []
        assert the_same_again(rig.close())

    run(scene())


def test_a_long_step_is_taken_in_parts(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pacing, "PART_NS", 0)

    async def scene() -> None:
        rig = Rig(feeder(), 0.0)
        answer = rig.do("step", for_ns=20 * SECOND)
        parts = 1
        while "to_ns" in answer:
            assert answer["time_ns"] < answer["to_ns"] == 20 * SECOND
            answer = rig.do("step", to_ns=answer["to_ns"])
            parts += 1
        assert parts > 10
        assert answer["time_ns"] == 20 * SECOND
        whole = feeder()
        whole.run(for_=20)
        assert recording_of(rig.close()).digest == recording_of(whole).digest

    run(scene())


def test_where_nothing_happens_any_more_a_step_says_so(run: Run) -> None:
    async def scene() -> None:
        rig = Rig(World.from_toml('[[mic488]]\nname = "a"\n'), 0.0)
        assert [rig.do("step")["idle"] for _ in range(2)] == [True, True]
        assert rig.do("step", for_ns=5)["idle"] is False
        rig.close()

    run(scene())


def test_a_script_that_stops_the_run_ends_a_step_and_the_command(run: Run) -> None:
    async def scene() -> None:
        world = World.from_toml('[[mic488]]\nname = "a"\n[[event]]\nat = 1\nsteps = [{ stop = "enough" }]\n')
        rig = Rig(world, 0.0)
        ended: list[Nanos] = []
        rig.live.on_stop = lambda: ended.append(world.now)
        answer = rig.do("step", for_ns=5 * SECOND)
        assert (answer["time_s"], answer["stopped"]) == (1.0, "enough")
        assert set(ended) == {SECOND}
        rig.close()

    run(scene())


class Client:
    def __init__(self) -> None:
        self.heard = b""

    def write(self, data: bytes) -> None:
        self.heard += data


ANSWER = with_crc(bytes.fromhex("01 03 04 00 00 43 16"))


@pytest.mark.parametrize("timing", ["real", "off"])
@pytest.mark.parametrize("kind", ["tcp", "rtu"])
def test_a_standing_world_answers_what_takes_no_time(run: Run, timing: str, kind: str) -> None:
    """With real timing a request is on its way until time goes on."""
    world = World.from_toml((EXAMPLES / "feeder.toml").read_text().replace('timing = "real"', f'timing = "{timing}"'))
    request, answer = READ_POSITION, ANSWER
    if kind == "tcp":
        request, answer = bytes.fromhex("00 07 00 00 00 06") + request[:-2], bytes.fromhex("00 07 00 00 00 07") + answer[:-2]

    async def scene() -> None:
        rig = Rig(world, 0.0)
        assert "to_ns" not in rig.do("step", for_ns=20 * SECOND)
        client = Client()
        feed = Feed(rig.realtime, ClientPort(rig.live, "bus", f"{kind}-1", kind), client)
        feed.take(request)
        await asyncio.sleep(100)
        assert client.heard == (b"" if timing == "real" else answer)
        rig.do("step", for_ns=20 * MILLISECOND)
        await asyncio.sleep(0)
        assert client.heard == answer
        feed.close()
        assert the_same_again(rig.close())

    run(scene())


def test_what_a_hand_does_to_a_standing_world_leads_to_something_at_that_moment(run: Run, tmp_path: Path) -> None:
    async def scene() -> None:
        rig = Rig(World.from_toml(CLOCKLESS), 0.0)
        rig.do("step", for_ns=SECOND)
        rig.do("set", levels={"a.IN1": 1})
        assert rig.do("pins")["a.IN2"] == 1.0
        answer = rig.do("save", file=str(tmp_path / "s.json"))
        assert (answer["time_ns"], answer["inputs"]) == (SECOND, 1)
        recording = load(tmp_path / "s.json")
        assert recording.replay().trace.digest() == answer["digest"] == recording.digest
        rig.do("set", levels={"a.IN3": 1})
        rig.do("step", for_ns=5 * SECOND)
        assert rig.do("pause")["time_ns"] == 6 * SECOND
        assert rig.lags == []
        assert the_same_again(rig.close())

    run(scene())


def test_without_a_clock_a_world_can_be_paused_and_slowed_down_too(run: Run) -> None:
    async def scene() -> None:
        rig = Rig(World.from_toml(CLOCKLESS), has_clients=False)
        await asyncio.sleep(0.5)
        assert rig.do("resume", speed="max")["speed"] == "max"
        for _ in range(12):
            await asyncio.sleep(0)
        assert rig.live.now >= 100 * SECOND
        stood = rig.do("pause")["time_ns"]
        await asyncio.sleep(1)
        assert rig.do("resume", speed=1)["time_ns"] == stood
        await asyncio.sleep(1)
        assert rig.do("pause")["time_ns"] == stood + SECOND
        assert the_same_again(rig.close())

    run(scene())


@pytest.mark.parametrize(
    ("what", "request_", "message"),
    [
        ("resume", {"speed": "max"}, "has lines with external clients, which need real time"),
        ("resume", {"speed": 0}, "speed: 0: expected a number from 0.001 to 1000, or 'max'"),
        ("resume", {"speed": float("nan")}, "speed: nan: expected a number"),
        ("step", {"for_ns": -1}, "for_ns: -1: expected whole nanoseconds from 0 to"),
        ("step", {"until": "nothing > 3"}, "nothing is called 'nothing'"),
        ("save", {}, "save: file is missing, expected a text: Absolute path"),
        ("save", {"file": "s.json"}, "file = 's.json': must be the absolute path"),
        ("save", {"file": "/tmp/no session"}, "for a recording, name the file NAME.json"),
        ("save", {"file": "/nowhere/at/all/s.json"}, "cannot write /nowhere/at/all/s.json: there is no folder /nowhere/at/all"),
    ],
)
def test_what_cannot_be_done_is_told_and_changes_nothing(run: Run, what: str, request_: dict[str, Any], message: str) -> None:
    async def scene() -> None:
        rig = Rig(feeder())
        with pytest.raises(Misuse, match=message):
            rig.do(what, **request_)
        assert (rig.pace.speed, rig.realtime.clock.speed) == (1.0, 1.0)
        await asyncio.sleep(1)
        rig.do("resume")
        assert rig.close().now == SECOND

    run(scene())


def test_a_session_goes_on_live_without_those_who_were_there(run: Run, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    description = (
        CLOCKLESS.replace('name = "a"', 'name = "a"\nline = "bus"', 1)
        + '[[line]]\nname = "bus"\nkind = "modbus"\n[[event]]\nat = 5\nsteps = [{ stop = "enough" }]\n'
    )

    async def scene() -> None:
        rig = Rig(World.from_toml(description), 0.0)
        rig.do("step", for_ns=2 * SECOND)
        ClientPort(rig.live, "bus", "tcp-1", "tcp").exchange(b"\0", rig.realtime.enter())
        rig.do("save", file=str(tmp_path / "s.json"))
        rig.close()

    run(scene())
    fast, end = LiveOptions(speed="max"), tmp_path / "end.json"
    options = UpOptions(world=tmp_path / "s.json", run=WorldRunOptions(session=end), live=fast)
    assert up(options)
    assert "5.000 s, 2 inputs, ended by: enough" in capfd.readouterr().out
    recording = load(tmp_path / "end.json")
    assert [type(given.what).__name__ for given in recording.inputs] == ["Bytes", "Leave"]
    assert recording.replay().trace.digest() == recording.digest
    assert up(UpOptions(world=tmp_path / "s.json", run=WorldRunOptions(from_="1s", session=end), live=fast))
    assert load(tmp_path / "end.json").inputs == ()


def test_what_a_script_stopped_goes_on_from_its_session(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    world, first, second = tmp_path / "w.toml", tmp_path / "1.json", tmp_path / "2.json"
    steps = '[{ wait = "1 s" }, { stop = "here" }, { note = "on" }, { wait = "1 s" }, { stop = "there" }]'
    world.write_text(f'[[mic488]]\nname = "a"\n[[script]]\nname = "s"\nsteps = {steps}\n')
    assert up(UpOptions(world=world, run=WorldRunOptions(seed=5, session=first), live=LiveOptions(speed="1000")))
    assert "1.000 s, 0 inputs, ended by: here" in capfd.readouterr().out
    assert up(UpOptions(world=first, run=WorldRunOptions(session=second), live=LiveOptions(speed="1000")))
    told = capfd.readouterr().out
    assert "note: on" in told
    assert "2.000 s, 0 inputs, ended by: there" in told
    recording = load(second)
    assert recording.seed == 5
    assert recording.replay().trace.digest() == recording.digest


ONE_ON_EACH = f"""{TWO_LINES}
    [[mic488]]
    name = "m"
    line = "bus"
    [[m1486]]
    name = "k"
    line = "chips"
"""


def test_going_back_leaves_programs_connected_and_the_session_whole(run: Run) -> None:
    """A master reads the position of then; a program on a shared line receives what comes from then on, nothing twice."""

    async def scene() -> World:
        rig = Rig(World.from_toml(dedent(ONE_ON_EACH)))
        rig.do("enable", controller="m", axis=1)
        rig.do("jog", controller="m", axis=1, velocity=40.0)
        rig.do("step", for_ns=3 * SECOND)
        bus, chips = ClientPort(rig.live, "bus", "tcp-1", "tcp"), ClientPort(rig.live, "chips", "tcp-1", "raw")
        read = bytes.fromhex("0001 0000 0006") + READ_POSITION[:-2]
        rig.do("send", line="chips", text="u20\r")
        rig.do("step", for_ns=SECOND)
        before = bus.exchange(read, rig.world.now)
        rig.do("snapshot", name="here")
        heard = b"".join(data for _, data in chips.to_send(rig.world.now))
        rig.do("resume")
        await asyncio.sleep(4)
        rig.realtime.enter()
        late = ClientPort(rig.live, "chips", "tcp-2", "raw")
        assert bus.exchange(read, rig.world.now) != before
        assert rig.do("restore", name="here")["time_ns"] == 4 * SECOND == rig.world.now
        assert rig.do("time")["paused"]
        assert bus.exchange(read, rig.world.now) == before
        assert chips.to_send(rig.world.now) == []
        rig.do("step", for_ns=SECOND)
        rig.do("send", line="chips", text="u20\r")
        rig.do("step", for_ns=SECOND)
        there = [b"".join(data for _, data in port.to_send(rig.world.now)) for port in (chips, late)]
        assert there[0] == there[1] == heard == b"B"
        rig.do("resume")
        await asyncio.sleep(2)
        assert rig.do("time")["time_ns"] == 8 * SECOND
        return rig.close()

    assert the_same_again(run(scene()))


def test_what_cannot_go_back_is_refused(run: Run, tmp_path: Path) -> None:
    async def scene(world: World, *, writes: bool) -> None:
        rig = Rig(world)
        rig.live.trace_file = Path("t.jsonl") if writes else None
        rig.do("snapshot", name="a")
        rig.do("restore", name="a")

    with pytest.raises(Refusal, match="the trace of this world is written to a file, which cannot go back"):
        run(scene(feeder(), writes=True))
    lasting = World.load(EXAMPLES / "feeder.toml", state=tmp_path)
    with lasting, pytest.raises(Refusal, match=f"keeps its memory in {tmp_path}, which cannot go back"):
        run(scene(lasting, writes=False))

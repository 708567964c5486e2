"""When samples of controllers are taken, in virtual time."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable

import pytest
from gateway_rig import GatewayWorld
from virtual_loop import run_virtually

from steptwin.controller import MILLISECOND, SECOND
from steptwin.errors import LineFailure, Refusal, SteptwinError
from steptwin.gateways.points import CLOCK, CLOCK_POINTS, State
from steptwin.gateways.sampling import AT_ONCE, MOST_EVENTS, REST_S, TICK_S, Sampler
from steptwin.simulation.script.steps import Note, Send, Set, Turn
from steptwin.subject import commands as command
from steptwin.subject.contract import Result

TEXT = '[[mic488]]\nname = "table"\n[[mic488]]\nname = "other"\n'
CONTROLLERS = ("table", "other")
INTERVAL_S = 0.1


class Gateway:
    """Follows controllers of a world as gateways do."""

    def __init__(self, world: GatewayWorld, *, interval_s: float = INTERVAL_S, registers: Iterable[str] = ()) -> None:
        self.world = world
        interval = round(interval_s * 1000) * MILLISECOND
        self.sampler = Sampler(world.samples, {"other": registers}, interval)
        self.seen: list[tuple[float, str]] = []
        """When samples have come, s."""
        self.states: dict[str, State | None] = {}
        self.sampler.watch(CONTROLLERS)
        self.task = asyncio.create_task(self._run())

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            for sample in await self.sampler.changed(INTERVAL_S):
                self.seen.append((round(loop.time(), 3), sample.controller))
                self.states[sample.controller] = sample.state

    async def after(self, seconds: float) -> list[str]:
        """Whose samples come meanwhile."""
        self.seen.clear()
        await asyncio.sleep(seconds)
        return [controller for _, controller in self.seen]

    async def rest(self) -> None:
        """What happens at the beginning has been seen, and both have just been looked at."""
        await self.after(2.0)
        while not await self.after(TICK_S):
            pass

    async def close(self) -> None:
        self.task.cancel()
        await asyncio.wait((self.task,))
        self.sampler.close()

    @property
    def reads(self) -> int:
        return len([one for one in self.world.done if isinstance(one, command.ReadState) and one.controller == "table"])


def story(act: Callable[[Gateway], Awaitable[None]], *, registers: Iterable[str] = (), text: str = TEXT) -> None:
    async def play() -> None:
        gateway = Gateway(GatewayWorld(text), registers=registers)
        await act(gateway)
        await gateway.close()

    run_virtually(play())


def set_pin(gateway: Gateway, level: float = 1.0) -> None:
    gateway.world.inner.do(Set((("table", "IN3", level),)))


def test_controllers_at_rest_are_read_as_a_whole_now_and_then() -> None:
    async def act(gateway: Gateway) -> None:
        await gateway.rest()
        gateway.world.done.clear()
        assert sorted(await gateway.after(REST_S)) == ["other", "table"]
        assert gateway.world.done == [command.ReadState(controller) for _, controller in gateway.seen]

    story(act)


def test_an_event_is_a_reason_at_once_but_not_twice_in_an_interval() -> None:
    async def act(gateway: Gateway) -> None:
        await gateway.rest()
        await gateway.after(2 * INTERVAL_S)
        set_pin(gateway)
        assert await gateway.after(2 * TICK_S) == ["table"]
        assert gateway.states["table"] is not None
        assert gateway.states["table"]["pins"]["IN3"] == 1.0
        for level in (0.0, 1.0, 0.0):
            set_pin(gateway, level)
        assert await gateway.after(INTERVAL_S - 4 * TICK_S) == []
        assert await gateway.after(5 * TICK_S) == ["table"]
        assert gateway.states["table"]["pins"]["IN3"] == 0.0

    story(act)


def test_a_controller_in_motion_is_always_looked_at() -> None:
    async def act(gateway: Gateway) -> None:
        world = gateway.world.inner
        await gateway.rest()
        world.do(command.Enable("other", 1))
        world.do(command.Move("other", 1, by=1000.0))
        await gateway.after(INTERVAL_S)
        assert await gateway.after(3 * INTERVAL_S) == ["other"] * 3
        world.do(command.Advance(duration=600 * SECOND))
        assert "other" in await gateway.after(2 * INTERVAL_S)
        assert "other" not in await gateway.after(3 * INTERVAL_S)

    story(act)


def test_named_registers_are_a_reason_too() -> None:
    async def act(gateway: Gateway) -> None:
        await gateway.rest()
        assert (await gateway.after(3.5 * INTERVAL_S)).count("other") in (3, 4)

    story(act, registers=["M1_VMAX"])


def test_after_lost_events_and_another_past_everything_is_looked_at() -> None:
    async def act(gateway: Gateway) -> None:
        world = gateway.world.inner
        await gateway.rest()
        await gateway.after(2 * INTERVAL_S)
        for number in range(MOST_EVENTS + 1):
            world.do(Note(str(number)))
        assert sorted(await gateway.after(2 * TICK_S)) == ["other", "table"]
        world.do(command.TakeSnapshot("before"))
        await gateway.after(2 * INTERVAL_S)
        world.do(command.RestoreSnapshot("before"))
        assert sorted(await gateway.after(2 * TICK_S)) == ["other", "table"]

    story(act)


@pytest.mark.parametrize("silence", [LineFailure("no answer"), Refusal("illegal data address")])
def test_a_silent_controller_has_no_state(silence: SteptwinError) -> None:
    """Or one that refuses what it is asked: who asks goes on."""

    async def act(gateway: Gateway) -> None:
        gateway.world.silence = silence
        gateway.world.silent.add("table")
        await gateway.rest()
        assert [gateway.states[name] is None for name in CONTROLLERS] == [True, False]
        gateway.world.silent.clear()
        await gateway.after(2 * INTERVAL_S)
        assert gateway.states["table"] is not None

    story(act)


def test_gateways_share_samples() -> None:
    async def act(gateway: Gateway) -> None:
        second, third = Gateway(gateway.world), Gateway(gateway.world, interval_s=0.25)
        await gateway.rest()
        await gateway.after(0.3)
        before = gateway.reads
        for position in (1.0, 2.0, 3.0):
            gateway.world.inner.do(Turn("table", 1, round(position)))
            await asyncio.sleep(0.3)
        seen = [len([name for _, name in one.seen if name == "table"]) for one in (gateway, second, third)]
        assert min(seen) >= 3
        assert gateway.reads - before == 3
        assert gateway.states["table"] is second.states["table"]
        await second.close()
        await third.close()

    story(act)


def test_what_has_not_changed_is_the_same_object() -> None:
    async def act(gateway: Gateway) -> None:
        await gateway.rest()
        before = gateway.states["table"]
        set_pin(gateway)
        await gateway.after(2 * INTERVAL_S)
        now = gateway.states["table"]
        assert before is not None
        assert now is not None
        same = [name for name in ("status", "program", "pins", "details", "registers") if before[name] is now[name]]
        assert same == ["status", "program", "details", "registers"]
        assert all(old is new for old, new in zip(before["axes"], now["axes"], strict=True))

    story(act)


def test_a_gateway_that_is_late_gets_the_latest_values() -> None:
    """Nothing waits for it but the names of controllers, each once."""

    async def act(gateway: Gateway) -> None:
        sampler = Sampler(gateway.world.samples, {})
        sampler.watch(CONTROLLERS)
        for number in range(50):
            set_pin(gateway, number % 2)
            await asyncio.sleep(INTERVAL_S)
        found = await sampler.changed(INTERVAL_S)
        assert sorted(sample.controller for sample in found) == ["other", "table"]
        (table,) = [sample.state for sample in found if sample.controller == "table"]
        assert table is not None
        assert table["pins"]["IN3"] == 1.0
        sampler.close()

    story(act)


def test_many_controllers_come_in_parts() -> None:
    async def act() -> None:
        world = GatewayWorld("".join(f'[[mic488]]\nname = "t{number}"\n' for number in range(AT_ONCE + 6)))
        sampler = Sampler(world.samples, {})
        sampler.watch(part.name for part in world.description.controllers)
        assert [len(await sampler.changed(INTERVAL_S)) for _ in range(2)] == [AT_ONCE, 6]
        sampler.close()

    run_virtually(act())


def test_what_is_not_watched_any_more_does_not_come() -> None:
    async def act(gateway: Gateway) -> None:
        gateway.sampler.watch(["other"])
        await gateway.after(INTERVAL_S)
        set_pin(gateway)
        assert "table" not in await gateway.after(2.0)

    story(act)


def test_the_clock() -> None:
    async def act() -> None:
        world = GatewayWorld(TEXT)
        world.inner.do(command.Advance(duration=3 * SECOND))
        sample = await Sampler(world.samples, {}).take(CLOCK)
        assert sample.state is not None
        assert [point.read(sample.state) for point in CLOCK_POINTS] == [3.0, True, None]

    run_virtually(act())


def test_nothing_is_followed_after_the_end() -> None:
    world = GatewayWorld(TEXT)
    samplers = [Sampler(world.samples, {}) for _ in range(2)]
    samplers[0].close()
    assert world.inner.subscribers
    samplers[1].close()
    assert not world.inner.subscribers


def test_an_edge_brings_its_level() -> None:
    """Nothing is read for it."""

    async def act(gateway: Gateway) -> None:
        await gateway.rest()
        set_pin(gateway)
        await gateway.after(2 * INTERVAL_S)
        gateway.world.done.clear()
        set_pin(gateway, 0.0)
        assert await gateway.after(2 * TICK_S) == ["table"]
        assert gateway.world.done == []
        assert gateway.states["table"] is not None
        assert gateway.states["table"]["pins"]["IN3"] == 0.0

    story(act)


def test_a_write_on_a_line_may_change_all_of_its_controllers() -> None:
    text = '[[line]]\nname = "chips"\nkind = "m1486"\n' + "".join(
        f'[[m1486]]\nname = "{name}"\nline = "chips"\naddress = {number}\n' for number, name in enumerate(CONTROLLERS, start=3)
    )

    async def act(gateway: Gateway) -> None:
        await gateway.rest()
        await gateway.after(2 * INTERVAL_S)
        gateway.world.inner.do(Send("chips", b"x3\rs77\r"))
        assert sorted(set(await gateway.after(2 * TICK_S))) == ["other", "table"]
        await gateway.after(INTERVAL_S)
        assert [state["details"]["S"] for state in gateway.states.values() if state is not None].count(77) == 1

    story(act, text=text)


def test_a_read_that_ends_after_the_last_gateway_has_left_is_no_sample_for_the_next_one() -> None:
    async def scene() -> None:
        world = GatewayWorld(TEXT)
        answers, do = asyncio.Event(), world.do

        async def slow(wanted: command.Command) -> Result:
            await answers.wait()
            return await do(wanted)

        first = Sampler(world.samples, {})
        await first.take("table")
        await do(command.Enable("table", 1))
        world.do = slow  # type: ignore[method-assign]
        reading = asyncio.create_task(first.present("table"))
        await asyncio.sleep(0)
        first.close()
        answers.set()
        await reading
        await do(Set((("table", "IN3", 1.0),)))
        state = (await Sampler(world.samples, {}).present("table")).state
        assert state is not None
        assert state["pins"]["IN3"] == 1.0

    run_virtually(scene())

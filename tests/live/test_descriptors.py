"""Descriptors are served in turns: all that is ready, in batches, without keeping the loop from anything else."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

import pytest

from steptwin.live import descriptors as module
from steptwin.live.batches import batches
from steptwin.live.descriptors import BATCH, LINGER_NS, TURN_NS, Descriptors, descriptors

Run = Callable[..., Any]


@contextmanager
def pipes(count: int, *, full: bool = True) -> Generator[list[tuple[int, int]]]:
    """Ends to read and to write; something lies in each."""
    ends = [os.pipe() for _ in range(count)]
    try:
        for _, write in ends if full else ():
            os.write(write, b"x")
        yield ends
    finally:
        for end in ends:
            for descriptor in end:
                os.close(descriptor)


class FakeTime:
    """Every look at the clock takes a while."""

    def __init__(self, step_ns: int) -> None:
        self.looks = 0
        self._step_ns = step_ns

    def monotonic_ns(self) -> int:
        self.looks += 1
        return self.looks * self._step_ns


def test_a_loop_has_one_set(run: Run) -> None:
    async def scene() -> tuple[Descriptors, Descriptors]:
        return descriptors(), descriptors()

    one, same = run(scene())
    other, _ = run(scene())
    assert one is same
    assert one is not other


def test_what_is_ready_together_is_one_batch(run: Run) -> None:
    async def scene() -> tuple[list[int], int]:
        watched, seen = descriptors(), []
        with pipes(BATCH + 2) as ends:

            def serve(read: int) -> Callable[[], None]:
                def act() -> None:
                    os.read(read, 1)
                    seen.append(batches().current)

                return act

            for read, _ in ends:
                watched.await_input(read, serve(read))
            await asyncio.sleep(0.01)
            for read, _ in ends:
                watched.forget(read)
        return seen, batches().current

    found, between = run(scene())
    assert found == [1] * BATCH + [2] * 2
    assert between == 0


def test_what_is_forgotten_within_a_batch_is_not_served(run: Run) -> None:
    async def scene() -> list[int]:
        watched, served = descriptors(), []
        with pipes(2) as ends:

            def serve() -> None:
                served.append(1)
                for read, _ in ends:
                    watched.forget(read)

            for read, _ in ends:
                watched.await_input(read, serve)
            await asyncio.sleep(0.01)
        return served

    assert run(scene()) == [1]


def test_to_forget_what_is_not_awaited_changes_nothing(run: Run) -> None:
    async def scene() -> list[bytes]:
        watched, served = descriptors(), []
        with pipes(2) as ((read, _), (other, _)):
            watched.await_input(read, lambda: served.append(os.read(read, 1)))
            watched.forget(other)
            await asyncio.sleep(0.01)
            watched.forget(read)
            watched.forget(read)
        return served

    assert run(scene()) == [b"x"]


def test_room_and_input_of_one_descriptor(run: Run) -> None:
    """A blocked writer waits for room, and for nothing else."""

    async def scene() -> list[str]:
        watched, happened = descriptors(), []
        with pipes(1, full=False) as ((read, write),):
            os.set_blocking(write, False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    os.write(write, bytes(65536))

            def room() -> None:
                happened.append("room")
                watched.forget(write)

            watched.await_room(write, room)
            await asyncio.sleep(0.01)
            happened.append("reads")
            os.read(read, 1 << 20)
            await asyncio.sleep(0.01)
        return happened

    assert run(scene()) == ["reads", "room"]


def test_trouble_with_one_is_told_and_others_are_served() -> None:
    async def scene() -> tuple[list[str], list[int], int]:
        watched, served, told = descriptors(), [], []
        asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(str(context["exception"])))
        with pipes(2) as ((bad, _), (good, _)):

            def fail() -> None:
                os.read(bad, 1)
                raise ValueError("bad")

            watched.await_input(bad, fail)
            watched.await_input(good, lambda: served.append(len(os.read(good, 1))))
            await asyncio.sleep(0.01)
            watched.forget(bad)
            watched.forget(good)
        return told, served, batches().current

    assert asyncio.run(scene()) == (["bad"], [1], 0)


def test_a_turn_ends_though_there_is_always_more_to_do(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "time", FakeTime(TURN_NS // 10))

    async def scene() -> int:
        watched, served = descriptors(), []
        with pipes(1) as ((read, _),):
            watched.await_input(read, lambda: served.append(1))  # leaves it there
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            count = len(served)
            watched.forget(read)
        return count

    assert 5 <= run(scene()) <= 20


def test_looking_again_is_given_up_where_it_is_in_vain(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = FakeTime(LINGER_NS // 20)
    monkeypatch.setattr(module, "time", clock)

    async def scene() -> list[int]:
        """Looks at the clock in each of some turns with one request each."""
        watched, looks = descriptors(), []
        with pipes(1, full=False) as ((read, write),):

            def serve() -> None:
                os.read(read, 1)

            watched.await_input(read, serve)
            for _ in range(12):
                before = clock.looks
                os.write(write, b"x")
                await asyncio.sleep(0.01)
                looks.append(clock.looks - before)
            watched.forget(read)
        return looks

    looks = run(scene())
    assert [index for index, count in enumerate(looks) if count > 20] == [0, 2, 6]
    assert all(count < 5 for index, count in enumerate(looks) if index not in (0, 2, 6))


def test_who_asks_again_at_once_is_served_in_the_same_turn(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "time", FakeTime(1))

    async def scene() -> tuple[int, int]:
        watched, turns, served = descriptors(), 0, 0
        with pipes(1) as ((read, write),):
            looks = 0

            class Poll:
                """Somebody writes while the set is looked at in vain."""

                def __init__(self, epoll: Any) -> None:
                    self._epoll = epoll

                def __getattr__(self, name: str) -> Any:
                    return getattr(self._epoll, name)

                def poll(self, timeout: float, most: int) -> list[tuple[int, int]]:
                    nonlocal looks
                    looks += 1
                    if looks in (4, 8, 12):
                        os.write(write, b"x")
                    return self._epoll.poll(timeout, most)

            watched._epoll = Poll(watched._epoll)  # type: ignore[assignment]

            def serve() -> None:
                nonlocal served
                os.read(read, 1)
                served += 1

            watched.await_input(read, serve)
            turn = watched._turn

            def counted() -> None:
                nonlocal turns
                turns += 1
                turn()

            counted()
            watched.forget(read)
        return turns, served

    assert run(scene()) == (1, 4)

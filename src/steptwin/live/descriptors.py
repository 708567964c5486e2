"""The file descriptors of all links of a process in one epoll set, served in turns (Linux).

An event loop needs a transport, a handle and often a sleep for every request. Here the loop is woken once, and all ready
descriptors are served until none is left, so that a request costs little more than its read and write.
"""

from __future__ import annotations

import asyncio
import select
import time
from collections.abc import Callable
from typing import TypeAlias
from weakref import WeakKeyDictionary

from steptwin.live.batches import Batches, batches

Serve: TypeAlias = Callable[[], None]
"""Called while a descriptor is ready, again and again; it may await or forget any descriptor, and must not block."""

TURN_NS = 1_000_000
"""Longest time before timers and other descriptors of the loop are served, ns."""
BATCH = 128
"""Descriptors served per call of epoll."""
LINGER_NS = 50_000
"""A client often sends its next request right after an answer: polling that long without sleeping saves the wake-up."""
MOST_SKIPPED = 1023


class Descriptors:
    """The epoll set of an event loop. A descriptor is awaited either for input or for room for output."""

    def __init__(self, loop: asyncio.AbstractEventLoop, batches: Batches) -> None:
        self._batches = batches
        self._last_batch = 0
        self._epoll = select.epoll()
        self._serve: dict[int, Serve] = {}
        # Lingering that was in vain is not repeated for so many turns, and then longer still: slow masters cost nothing,
        # and where there is one processor only no other task would run meanwhile.
        self._skipped = 0
        self._to_skip = 0
        loop.add_reader(self._epoll.fileno(), self._turn)

    def await_input(self, descriptor: int, serve: Serve) -> None:
        """Call ``serve`` while there is something to read, or the other end has closed."""
        self._await(descriptor, select.EPOLLIN, serve)

    def await_room(self, descriptor: int, serve: Serve) -> None:
        """Call ``serve`` while there is room to write, or the other end has closed."""
        self._await(descriptor, select.EPOLLOUT, serve)

    def _await(self, descriptor: int, events: int, serve: Serve) -> None:
        if descriptor in self._serve:
            self._epoll.modify(descriptor, events)
        else:
            self._epoll.register(descriptor, events)
        self._serve[descriptor] = serve

    def forget(self, descriptor: int) -> None:
        """Stop awaiting an open descriptor; no effect if it was not awaited."""
        if self._serve.pop(descriptor, None) is not None:
            self._epoll.unregister(descriptor)

    def _turn(self) -> None:
        poll, serving, now = self._epoll.poll, self._serve, time.monotonic_ns
        end = now() + TURN_NS
        ready = poll(0, BATCH)
        while ready:
            self._batches.current = self._last_batch = self._last_batch + 1
            try:
                for descriptor, _ in ready:
                    serve = serving.get(descriptor)
                    if serve is not None:  # one served before it has not ended it
                        serve()
            finally:
                self._batches.current = 0
            if now() > end:
                return
            ready = poll(0, BATCH) or self._linger()

    def _linger(self) -> list[tuple[int, int]]:
        if self._skipped < self._to_skip:
            self._skipped += 1
            return []
        self._skipped = 0
        poll, now = self._epoll.poll, time.monotonic_ns
        end = now() + LINGER_NS
        while now() < end:
            ready = poll(0, BATCH)
            if ready:
                self._to_skip = 0
                return ready
        self._to_skip = min(2 * self._to_skip + 1, MOST_SKIPPED)
        return []


_of_loops: WeakKeyDictionary[asyncio.AbstractEventLoop, Descriptors] = WeakKeyDictionary()


def descriptors() -> Descriptors:
    """The epoll set of the running event loop."""
    loop = asyncio.get_running_loop()
    found = _of_loops.get(loop)
    if found is None:
        found = _of_loops[loop] = Descriptors(loop, batches())
    return found

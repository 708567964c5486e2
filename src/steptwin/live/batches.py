"""Batches: inputs that were found ready together happen at one moment."""

from __future__ import annotations

import asyncio
from weakref import WeakKeyDictionary


class Batches:
    """The batches of an event loop. Only links on an epoll set make batches (`steptwin.live.descriptors`)."""

    __slots__ = ("current",)

    def __init__(self) -> None:
        self.current = 0
        """The number of the batch that is being served; 0 between batches, where every input has a moment of its own."""


_of_loops: WeakKeyDictionary[asyncio.AbstractEventLoop, Batches] = WeakKeyDictionary()


def batches() -> Batches:
    """The batches of the running event loop."""
    return _of_loops.setdefault(asyncio.get_running_loop(), Batches())

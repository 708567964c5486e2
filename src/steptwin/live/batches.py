"""Which inputs happen at one moment: those that were found ready together, a batch."""

from __future__ import annotations

import asyncio
from weakref import WeakKeyDictionary


class Batches:
    """Of an event loop. Only links that see what is ready together make batches (`steptwin.live.descriptors`)."""

    __slots__ = ("current",)

    def __init__(self) -> None:
        self.current = 0
        """The number of the batch that is being served; 0 between batches, where every input has a moment of its own."""


_of_loops: WeakKeyDictionary[asyncio.AbstractEventLoop, Batches] = WeakKeyDictionary()


def batches() -> Batches:
    """Those of the running loop, which live as long as the loop."""
    return _of_loops.setdefault(asyncio.get_running_loop(), Batches())

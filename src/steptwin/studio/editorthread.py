"""A thread in which texts are analysed: checking a long one takes longer than a master waits. Nothing but texts goes from one
thread to the other."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import TypeVar

from steptwin.studio.viewers import PATIENCE_S

T = TypeVar("T")


class EditorThread:
    """A thread with an event loop, from the first call on."""

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None

    async def __call__(self, call: Callable[[], T]) -> T:
        """Result of a call in the thread."""
        if self._loop is None:
            self._loop = asyncio.new_event_loop()
            self._thread = threading.Thread(target=self._loop.run_forever, name="editor server", daemon=True)
            self._thread.start()

        async def called() -> T:
            return call()

        return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(called(), self._loop))

    def close(self) -> None:
        if self._loop is not None and self._thread is not None:
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(PATIENCE_S)
            if not self._thread.is_alive():
                self._loop.close()
            self._loop = self._thread = None

"""An event loop in virtual time: sockets are real, timers come when nothing else is left to do, and nobody waits."""

from __future__ import annotations

import asyncio
import selectors
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, TypeVar

import pytest

from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488
from steptwin.runtime.cell import Cell
from steptwin.runtime.clock import Clock
from steptwin.world.kernel import Kernel

T = TypeVar("T")


@pytest.fixture(autouse=True, scope="session")
def own_runtime_directory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Twins of tests that run at the same time have the same names."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
        yield


class _Selector(selectors.DefaultSelector):
    """Where the loop would sleep, its time jumps."""

    loop: VirtualLoop

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        ready = super().select(0)
        if ready or timeout == 0:
            return ready
        if timeout is None:
            return super().select(5.0)  # nothing is planned: something outside has to happen
        self.loop.now_ns += max(round(timeout * 1e9), 1)
        return []


class VirtualLoop(asyncio.SelectorEventLoop):
    now_ns: int

    def __init__(self) -> None:
        selector = _Selector()
        selector.loop = self
        self.now_ns = 0
        super().__init__(selector)

    def time(self) -> float:
        return self.now_ns / 1e9

    def hold_up(self, seconds: float) -> None:
        """Time passes in which the process does nothing."""
        self.now_ns += round(seconds * 1e9)

    def clock(self) -> Clock:
        return Clock(wall_ns=lambda: self.now_ns)


@pytest.fixture
def run() -> Callable[[Coroutine[Any, Any, T]], T]:
    """``run(coroutine)`` in virtual time; what the loop has to complain about fails the test."""

    def run_(coroutine: Coroutine[Any, Any, T]) -> T:
        complaints: list[dict[str, Any]] = []

        def loop() -> VirtualLoop:
            made = VirtualLoop()
            made.set_exception_handler(lambda _, context: complaints.append(context))
            return made

        with asyncio.Runner(loop_factory=loop) as runner:
            result = runner.run(coroutine)
        assert complaints == []
        return result

    return run_


@pytest.fixture
def make_cell() -> Callable[[], tuple[Cell, Mic488]]:
    """``make_cell()``, in a running virtual loop: a cell with one MIC488 as it comes from the shop."""

    def make() -> tuple[Cell, Mic488]:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        device = Mic488(ControllerConfig())
        kernel = Kernel()
        kernel.add("1", device)
        return Cell(kernel, loop.clock()), device

    return make

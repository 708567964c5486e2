"""What the tests of the runtime share: an event loop in virtual time, and a cell with a controller."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, TypeVar

import pytest
from virtual_loop import VirtualLoop, run_virtually

from steptwin.mic488.config import ControllerConfig
from steptwin.mic488.device import Mic488
from steptwin.runtime.cell import Cell
from steptwin.world.kernel import Kernel

T = TypeVar("T")


@pytest.fixture(autouse=True, scope="session")
def own_runtime_directory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Twins of tests that run at the same time have the same names."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", str(tmp_path_factory.mktemp("run")))
        yield


@pytest.fixture
def run() -> Callable[[Coroutine[Any, Any, T]], T]:
    """``run(coroutine)`` in virtual time; what the loop has to complain about fails the test."""
    return run_virtually


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

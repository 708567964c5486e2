"""Trees that are used by several threads at the same time."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from typing import TypeVar

from mutants.trial import Tree

T = TypeVar("T")


class Workers:
    """Several trees, each with its thread."""

    def __init__(self, trees: list[Tree]) -> None:
        self._trees = trees
        self._free: queue.SimpleQueue[Tree] = queue.SimpleQueue()
        for tree in trees:
            self._free.put(tree)
        self._pool = ThreadPoolExecutor(len(trees))

    def each(self, tasks: Iterable[Callable[[Tree], T]]) -> Iterator[T]:
        """The results in the order in which they come."""
        futures: list[Future[T]] = [self._pool.submit(self._do, task) for task in tasks]
        return (future.result() for future in as_completed(futures))

    def end(self) -> None:
        """End the tests that run."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        for tree in self._trees:
            tree.end()

    def _do(self, task: Callable[[Tree], T]) -> T:
        tree = self._free.get()
        try:
            return task(tree)
        finally:
            self._free.put(tree)

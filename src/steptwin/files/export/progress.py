"""Progress of a long export."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from typing import TypeAlias

from steptwin.controller import Nanos

TimeProgress: TypeAlias = Callable[[Nanos], None]
"""Called with the moment (ns) that a run or an export has reached."""

ShowExport: TypeAlias = Callable[[str, Nanos, Nanos], AbstractContextManager[TimeProgress]]
"""Called with a title, begin and end of the work; gives the function that reports progress."""


def silent(_: Nanos) -> None:
    """No progress is shown."""


@contextmanager
def unwatched(_what: str, _begin: Nanos, _until: Nanos) -> Generator[TimeProgress]:
    yield silent


@contextmanager
def bar(what: str, begin: Nanos, until: Nanos) -> Generator[TimeProgress]:
    """A bar on standard error, if that is a terminal."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(what, total=max(until - begin, 1))
        yield lambda done: shown.update(task, completed=done - begin)

"""Parts that a scheduler runs between its controllers."""

from __future__ import annotations

from typing import Protocol

from steptwin.controller import Nanos
from steptwin.state import Plain


class ScheduledPart(Protocol):
    """A part between controllers: mechanics, a switch, a source, a line. Its state is plain (`steptwin.state.Stateful`)."""

    def deadline(self) -> Nanos | None:
        """The time of its next event of its own, as for a controller."""
        ...

    def update(self, now: Nanos) -> None:
        """Process events due by ``now`` and changes of what it depends on, repeatedly until nothing changes. Levels go to
        `Scheduler.drive`."""
        ...

    def copy_state(self) -> Plain: ...
    def set_state(self, plain: Plain) -> None: ...

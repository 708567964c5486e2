"""The decoded traffic of a world's lines, for ``up --log-frames``."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial

from steptwin.live.world import LiveWorld
from steptwin.simulation.kinds.lines import TrafficLog
from steptwin.simulation.kinds.registry import line_kinds
from steptwin.simulation.scheduler.trace import TraceRecord
from steptwin.wire.frameline import FrameLine


def subscribe_to_frames(live: LiveWorld, sink: Callable[[FrameLine], None]) -> None:
    """Decode the traffic of every line for ``sink``; ports opened from now on are included.

    With several lines, a link is shown with its line: ``bus/tcp-1``.
    """
    world = live.world
    for spec in world.spec.lines:
        line = world.lines[spec.name]
        log = line_kinds()[spec.kind].traffic_log(line, "" if len(world.lines) == 1 else f"{line.name}/", sink)
        line.subscribe_to_frames(log)
        members = {name for name, (on, _) in world.objects.line_of.items() if on is line}
        world.trace.subscribers.append(partial(_recorded, log, members))


def _recorded(log: TrafficLog, members: Collection[str], record: TraceRecord) -> None:
    if record.controller in members:
        log.recorded(record)

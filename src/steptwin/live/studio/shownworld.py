"""A live world as every studio shows it, whatever serves that: its subject, its present moment, its past."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from math import inf
from pathlib import Path

from steptwin.devices.composite import CompositeSubject
from steptwin.devices.worldmember import WorldMember
from steptwin.diagnostics import SourceText
from steptwin.files.loader import is_recording
from steptwin.live.pace import Pace
from steptwin.live.realtimedriver import RealTimeDriver
from steptwin.live.studio.drawing import WorldArrangement
from steptwin.live.timetravel import WorldTimeTravel
from steptwin.live.world import LiveWorld
from steptwin.live.world_control import WorldControl
from steptwin.simulation.world.snapshotlog import SnapshotLog
from steptwin.simulation.world.worldprograms import WorldPrograms, configuration_text
from steptwin.studio.requests import LineUse
from steptwin.studio.surroundings import PresentMoment, Surroundings
from steptwin.subject.jogs import WorldJogs


class ShownWorld:
    """A live world in a studio, from its making on. ``file``: its description, None without one; ``snapshots``: its past where
    it has one already."""

    def __init__(
        self,
        live: LiveWorld,
        realtime: RealTimeDriver,
        pace: Pace,
        control: WorldControl,
        *,
        file: Path | None = None,
        snapshots: SnapshotLog | None = None,
    ) -> None:
        self._live = live
        self._realtime = realtime
        self._pace = pace
        jogs = WorldJogs(live.subject, control.at_present)
        live.external_actor = jogs
        world = WorldMember(control, live.subject.subscribers, jogs)
        self.subject = CompositeSubject(world, lambda: self.moment().time, live.subject.numbering)
        self.time_travel = WorldTimeTravel(live, realtime, pace, snapshots)
        self.surroundings: Callable[..., Surroundings] = partial(
            Surroundings,
            moment=self.moment,
            programs=WorldPrograms(live.world),
            configuration=self._configuration,
            time_travel=self.time_travel,
            arrangement=self._arrangement(file),
            traffic=self._traffic,
        )

    def moment(self) -> PresentMoment:
        live, pace = self._live, self._pace
        goes = not pace.is_paused and live.world.stopped is None
        # An advance that is bounded may not reach where the clock is.
        follows = goes and pace.speed != inf and self._realtime.longest_ns is None
        return PresentMoment(max(self._realtime.clock.now(), live.now) if follows else live.now, goes, pace.speed)

    def _configuration(self, controller: str) -> SourceText | None:
        world = self._live.world
        return configuration_text(world, controller) if controller in world.controllers else None

    def _arrangement(self, file: Path | None) -> WorldArrangement:
        """Arrangement of the description in ``file``; that of a recording is in no file."""
        shown = self._live.subject.description
        names = [part.name for part in (*shown.axes, *shown.elements)]
        return WorldArrangement(self._live.world.spec, names, None if file is None or is_recording(file) else file)

    def _traffic(self) -> tuple[LineUse, ...]:
        connected = Counter(port.line for port in self._live.ports)
        return tuple([LineUse(name, connected[name], *line.traffic) for name, line in self._live.world.lines.items()])

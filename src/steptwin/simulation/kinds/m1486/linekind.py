"""Lines of M1486 chips as a kind of line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from steptwin.errors import Misuse
from steptwin.m1486.characterlog import changes_nothing
from steptwin.m1486.chip import M1486Chip
from steptwin.simulation.faults import Faults
from steptwin.simulation.kinds.kind import LineKind, LinkKind, Member
from steptwin.simulation.kinds.lines import LineWrite
from steptwin.simulation.kinds.links import LineSpec
from steptwin.simulation.kinds.m1486.line import ChipLine
from steptwin.simulation.kinds.m1486.trafficlog import ChipTrafficLog
from steptwin.simulation.scheduler.scheduler import Scheduler
from steptwin.simulation.scheduler.trace import RecordSink
from steptwin.wire.frameline import FrameLine
from steptwin.wire.slave import FrameDirection


class CharacterLines(LineKind[M1486Chip, ChipLine]):
    name = "m1486"
    meaning = "m1486"
    links: Mapping[str, LinkKind] = {
        "pty": LinkKind("raw", "pty", "M1486 line"),
        "serial": LinkKind("raw", "serial", "M1486 line"),
        "tcp": LinkKind("raw", "tcp", "M1486 line"),
        "rfc2217": LinkKind("raw", "tcp", "network port"),
    }

    def make(
        self, spec: LineSpec, members: Sequence[Member[M1486Chip]], scheduler: Scheduler, record: RecordSink, faults: Faults
    ) -> ChipLine:
        """As `LineKind.make`. Raises `Misuse` for addresses that are taken, and for strict timing."""
        if spec.timing == "strict":
            raise Misuse("timing = 'strict' is for lines of kind modbus: an M1486 has no time-out between characters")
        return ChipLine(scheduler, spec.name, record, faults, [member.controller for member in members])

    def traffic_log(self, line: ChipLine, prefix: str, sink: Callable[[FrameLine], None]) -> ChipTrafficLog:
        return ChipTrafficLog(line, prefix, sink)

    def writes(self, line: ChipLine, take: Callable[[LineWrite], None]) -> Callable[[], None]:
        """As `LineKind.writes`. Every chip receives what a host sends, and none answers."""

        def sent(shown: FrameLine) -> None:
            if shown.direction is FrameDirection.IN and not changes_nothing(shown.raw):
                take(LineWrite(shown.time, shown.link, (), shown.meaning, ""))

        log = ChipTrafficLog(line, "", sent)
        line.subscribe_to_frames(log)
        return partial(line.unsubscribe_from_frames, log)

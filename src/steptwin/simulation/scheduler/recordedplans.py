"""Plans of axes in traces: each new plan and each change of coordinates is recorded once."""

from __future__ import annotations

from steptwin.controller import Nanos
from steptwin.motion import Profile
from steptwin.motion.divisions import profile_of
from steptwin.motioncontroller import MotionController
from steptwin.simulation.scheduler.trace import RecordSink, TraceRecord


class RecordedPlans:
    """The plans and coordinate offsets of a controller's axes that were recorded last."""

    __slots__ = ("_drives", "_name", "_origins", "_profiles", "_revisions")

    def __init__(self, name: str, controller: MotionController) -> None:
        self._name = name
        self._drives = [(i, str(i + 1), drive) for i, drive in enumerate(controller.axes)]
        self._revisions = [-1] * len(self._drives)
        self._profiles: list[Profile | None] = [None] * len(self._drives)
        self._origins = [0] * len(self._drives)

    def report(self, record: RecordSink, now: Nanos) -> None:
        """Record new plans and changes of coordinates. A plan that only continues the rest at the same position is not new."""
        revisions = self._revisions
        for i, number, drive in self._drives:
            if drive.offset_p != self._origins[i]:
                origin = self._origins[i] = drive.offset_p
                record(TraceRecord(now, self._name, "coordinate", number, origin))
            revision = drive.revision
            if revisions[i] == revision:
                continue
            plan = drive.plan
            before, profile = self._profiles[i], plan if type(plan) is Profile else profile_of(plan)
            revisions[i], self._profiles[i] = revision, profile
            if before is None or profile.segments or not _only_rests(before, profile):
                record(TraceRecord(now, self._name, "plan", number, plan))

    def mark_reported(self) -> None:
        for i, _, drive in self._drives:
            self._revisions[i], self._profiles[i] = drive.revision, profile_of(drive.plan)
            self._origins[i] = drive.offset_p


def _only_rests(before: Profile, after: Profile) -> bool:
    """Whether ``after``, which is rest, is at the end position of ``before``."""
    return before.end is not None and before.end <= after.start and before.base + before.counts[-1] == after.base

"""State shared by all viewers: list of viewers, control, dead-man jogs, watched points, streams of events, the clock.

Pure: moments of the wall clock are arguments; sessions (`steptwin.studio.viewersession`) fetch the messages to send.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count

from steptwin.access.control import Control, Viewer
from steptwin.access.roles import Role
from steptwin.controller import MILLISECOND, SECOND, Nanos
from steptwin.diagnostics import SourceText
from steptwin.errors import Misuse, Refusal, SteptwinError
from steptwin.jsonvalues import to_json
from steptwin.messages import Message
from steptwin.studio.branchrequests import Branches
from steptwin.studio.calculations import Calculations
from steptwin.studio.campaignrequests import Campaigns, CampaignTexts
from steptwin.studio.configurations import Configurations
from steptwin.studio.controllers import Sheets
from steptwin.studio.drawingrequests import Arrangement
from steptwin.studio.eventlog import EventLog
from steptwin.studio.recordingrequests import RecordingFiles, Recordings
from steptwin.studio.requests import (
    OF_BRANCHES,
    OF_CAMPAIGNS,
    OF_DEVICES,
    OF_DRAWINGS,
    OF_RECORDING_FILES,
    OF_RECORDINGS,
    OF_SERVICES,
    OF_TIME_TRAVEL,
    OF_WORK,
    REQUESTS,
    LeaseTerm,
    WorldTraffic,
    permit_of,
)
from steptwin.studio.servicerequests import WorldServices
from steptwin.studio.streams import Streams
from steptwin.studio.surroundings import Connections, LongWork, Served, Surroundings
from steptwin.studio.watches import Watches
from steptwin.subject import commands as command
from steptwin.subject.commands import COMMANDS
from steptwin.subject.contract import Description, Reading, Result
from steptwin.subject.jogs import ExtendableJog, Jogs
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.standing import StandingKind, StandingState
from steptwin.subject.subscriptions import filter_of

MOST_VIEWERS = 64
MOST_LEASES = 32
STANDING_NS: Nanos = SECOND // 5
"""Interval at which what stands is looked at."""
CLOCK_NS: Nanos = SECOND
"""Interval at which viewers receive the present moment."""
FASTEST_JOG = 5.0
"""Highest speed, relative to real time, at which a jog can be renewed in time."""
LONGEST_LEASE_MS = 250
IDLE_NS: Nanos = 60 * SECOND
"""Control that was taken over REST ends after this time without a request."""


@dataclass(slots=True)
class Lease:
    """A jog and the viewer that holds it."""

    number: int
    viewer: Viewer
    jog: command.Jog
    held: ExtendableJog

    def to_json(self) -> dict[str, object]:
        head = {"lease": self.number, "viewer": self.viewer.number, "controller": self.jog.controller, "axis": self.jog.axis}
        return {**head, "velocity": self.jog.velocity}


class SharedState:
    """Parts of the state that are sent to all viewers after a change. ``changes`` counts the changes of all of them."""

    __slots__ = ("_changed", "_texts", "_values", "changes")

    def __init__(self, **values: object) -> None:
        self.changes = 0
        self._values = values
        self._texts = {name: json.dumps(value) for name, value in values.items()}
        self._changed = dict.fromkeys(values, 0)

    def put(self, name: str, value: object) -> None:
        if value != self._values[name]:
            self.repeat(name, value)

    def repeat(self, name: str, value: object) -> None:
        """Send it, also if it has not changed."""
        self.changes += 1
        self._values[name] = value
        self._texts[name] = json.dumps(value)
        self._changed[name] = self.changes

    def since(self, change: int) -> list[tuple[str, str]]:
        """Names of what has changed after the change with that number, and what there is now, as JSON."""
        return [(name, self._texts[name]) for name, number in self._changed.items() if number > change]


NO_WORLD_TO_RECORD = Message("studio.no-world-to-record", "no world to record here")
NO_FOLDER_FOR_RECORDINGS = Message(
    "studio.no-folder-for-recordings", "no folder for recordings here: save_recording makes a download of the browser"
)
NO_WORLD_TO_BRANCH = Message("studio.no-world-to-branch", "no world to branch here: start the studio with the file of a world")
NOT_IN_PLACE = Message("studio.not-in-place", "{request}: here no world is shown in place of another one")
NO_WORLD_TO_DRAW = Message("studio.no-world-to-draw", "no world to draw here: start the studio with the file of a world")
NO_WORLD_WITH_GATEWAYS = Message("studio.no-world-with-gateways", "no world here, so no gateways and no history")
CAMPAIGNS_ARE_FILES = Message("studio.campaigns-are-files", "the campaigns of this studio are files: change these")
NO_FILE_FOR_CAMPAIGNS = Message("studio.no-file-for-campaigns", "no campaigns here: start the studio with the file of a world")
NO_DEVICES = Message("studio.no-devices", "devices cannot be connected here: that needs the studio on a computer")
NO_WORLD_WITH_LINES = Message("studio.no-world-with-lines", "no world here, so no lines whose traffic is counted")
TOO_MANY_VIEWERS = Message("studio.too-many-viewers", "there are {most} viewers already, the most possible")
TOO_FAST_FOR_A_JOG = Message(
    "studio.too-fast-for-a-jog", "time goes too fast for a jog ({speed:g} times): it is possible up to {most:g} times"
)
TOO_MANY_JOGS = Message("studio.too-many-jogs", "too many jogs: the limit is {most} axes; end one")
VIEWER_HAS_GONE = Message("studio.viewer-has-gone", "the viewer has gone")
LEASE_HAS_ENDED = Message("studio.lease-has-ended", "lease {number} has ended, or is another viewer's")
NO_POINTS = Message("studio.no-points", "points: at least one is needed")


class Hub:
    """State shared by all viewers of one subject."""

    def __init__(self, subject: Served, jogs: Jogs, around: Surroundings) -> None:
        self.subject = subject
        self.around = around
        self.control = Control()
        self.streams = Streams(subject)
        self.log = EventLog(subject, around.moment().time)
        self.watches = Watches()
        self.viewers: dict[int, Viewer] = {}
        self.description = ""
        """Description of the subject, as JSON."""
        self.descriptions = 0
        """Number of descriptions so far: a viewer with another one is sent the whole state."""
        self._described: Description | None = None
        self._describe()
        sheets = Sheets(lambda: subject.description)
        self.configurations = Configurations(sheets, self._configuration, self._present)
        self.calculations = Calculations(sheets)
        self._jogs = jogs
        self._numbers = count(1)
        self._leases: dict[int, Lease] = {}
        self._lease_numbers = count(1)
        self._asked: dict[int, Nanos] = {}
        """When those over REST asked last."""
        self._clock_due: Nanos = 0
        self._running: tuple[bool, float] | None = None
        self._moment: tuple[Nanos, str] = (-1, "")
        self._workpieces: Sequence[WorkpieceState] = ()
        """As they were sent."""
        self._standing: Sequence[StandingState] = subject.standing()  # from now on it follows since when
        self._standing_due: Nanos = 0
        self._gateways: dict[str, Nanos | None] = {}
        """Moments at which gateways that were up were found down, by their place; None: up."""
        self.shared = SharedState(lost=None, control=None, viewers=0, leases=[], workpieces=[], standing=[], clock=None)

    def _describe(self) -> None:
        if self.subject.description is not self._described:
            self._described = self.subject.description
            self.description = json.dumps(self._described.to_json(), separators=(",", ":"))
            self.descriptions += 1

    @property
    def is_virtual(self) -> bool:
        return not any(part.is_real for part in self.subject.description.controllers)

    @property
    def recordings(self) -> Recordings:
        """Raises `Refusal` where there is no world."""
        if self.around.recordings is None:
            raise Refusal(NO_WORLD_TO_RECORD())
        return self.around.recordings

    @property
    def recording_files(self) -> RecordingFiles:
        """Raises as `recordings`, and where they are in no folder."""
        if self.around.recording_files is None:
            raise Refusal(NO_WORLD_TO_RECORD() if self.around.recordings is None else NO_FOLDER_FOR_RECORDINGS())
        return self.around.recording_files

    @property
    def branches(self) -> Branches:
        """Raises `Refusal` where there is no world."""
        if self.around.branches is None:
            raise Refusal(NO_WORLD_TO_BRANCH())
        return self.around.branches

    def show_branch(self, branch: int) -> None:
        """Raises `Misuse`, and `Refusal` where it has a page of its own."""
        if self.around.show_branch is None:
            raise Refusal(NOT_IN_PLACE(request="show_branch"))
        self.around.show_branch(branch)

    def leave_world(self) -> None:
        """Raises `Refusal` where no other world is to be shown."""
        if self.around.leave_world is None:
            raise Refusal(NOT_IN_PLACE(request="leave_world"))
        self.around.leave_world()

    @property
    def arrangement(self) -> Arrangement:
        """Raises `Refusal` where there is no world."""
        if self.around.arrangement is None:
            raise Refusal(NO_WORLD_TO_DRAW())
        return self.around.arrangement

    @property
    def services(self) -> WorldServices:
        """Raises `Refusal` where there is no world."""
        if self.around.services is None:
            raise Refusal(NO_WORLD_WITH_GATEWAYS())
        return self.around.services

    @property
    def campaigns(self) -> Campaigns:
        """Raises `Refusal` where there is no file of a world."""
        if self.around.campaigns is None:
            raise Refusal(NO_FILE_FOR_CAMPAIGNS())
        return self.around.campaigns

    @property
    def campaign_texts(self) -> CampaignTexts:
        """Raises `Refusal` where they are in files."""
        if self.around.campaign_texts is None:
            raise Refusal(CAMPAIGNS_ARE_FILES())
        return self.around.campaign_texts

    @property
    def connections(self) -> Connections:
        """Raises `Refusal` where no device can be connected."""
        if self.around.connections is None:
            raise Refusal(NO_DEVICES())
        return self.around.connections

    @property
    def work(self) -> LongWork:
        """Raises as `connections`."""
        if self.around.work is None:
            raise Refusal(NO_DEVICES())
        return self.around.work

    def traffic(self) -> WorldTraffic:
        """Raises `Refusal` where there is no world."""
        if self.around.traffic is None:
            raise Refusal(NO_WORLD_WITH_LINES())
        return WorldTraffic(self.around.moment().time, self.around.traffic())

    # ------------------------------------------------------------------ viewers

    def number(self) -> int:
        return next(self._numbers)

    def join(self, viewer: Viewer) -> None:
        """Raises `Refusal` where there are too many."""
        if len(self.viewers) >= MOST_VIEWERS:
            raise Refusal(TOO_MANY_VIEWERS(most=MOST_VIEWERS))
        self.viewers[viewer.number] = viewer
        self.shared.put("viewers", len(self.viewers))

    def leave(self, viewer: Viewer) -> None:
        """Jogs end, control passes."""
        if self.viewers.pop(viewer.number, None) is None:
            return
        self.shared.put("viewers", len(self.viewers))
        self._drop([lease for lease in self._leases.values() if lease.viewer.number == viewer.number])
        self.control.release(viewer)
        self._say_control()

    def may(self, role: Role) -> list[str]:
        """Names of requests that a role may use here."""
        of_subject = [name for name in COMMANDS if name in self.subject.description.commands]
        around = self.around
        needed = (
            (around.time_travel, OF_TIME_TRAVEL),
            (around.recordings, OF_RECORDINGS),
            (around.recording_files, OF_RECORDING_FILES),
            (around.branches, OF_BRANCHES),
            (around.show_branch, frozenset({"show_branch"})),
            (around.leave_world, frozenset({"leave_world"})),
            (around.arrangement, OF_DRAWINGS),
            (around.services, OF_SERVICES),
            (around.campaigns, OF_CAMPAIGNS),
            (around.campaign_texts, frozenset({"change_campaign"})),
            (around.connections, OF_DEVICES),
            (around.work, OF_WORK),
            (around.traffic, frozenset({"traffic"})),
        )
        missing = frozenset[str]().union(*(names for part, names in needed if part is None))
        own = [name for name in REQUESTS if name not in missing]
        return [name for name in (*of_subject, *own) if permit_of(name).role <= role]

    # ------------------------------------------------------------------ control

    def take_control(self, viewer: Viewer, *, over: bool) -> None:
        """Raises `Refusal` where another one holds it, without ``over``. Jogs of others end."""
        self.control.take(viewer, over=over)
        self._drop([lease for lease in self._leases.values() if lease.viewer.number != viewer.number])
        self._say_control()

    def release_control(self, viewer: Viewer) -> None:
        self._drop([lease for lease in self._leases.values() if lease.viewer.number == viewer.number])
        self.control.release(viewer)
        self._say_control()

    def _say_control(self) -> None:
        self.shared.put("control", self.holder())

    def holder(self) -> object:
        found = self.control.holder
        return None if found is None else {"viewer": found.number, "name": found.name}

    def asked(self, viewer: Viewer, now: Nanos) -> None:
        """A request without a connection (REST)."""
        self._asked[viewer.number] = now

    # ------------------------------------------------------------------ jogs

    async def begin_jog(self, viewer: Viewer, wanted: command.Jog) -> LeaseTerm:
        """Raises `Misuse` and `Refusal`."""
        speed = self.around.moment().speed
        if speed > FASTEST_JOG:
            raise Refusal(TOO_FAST_FOR_A_JOG(speed=speed, most=FASTEST_JOG))
        own = [one for one in self._leases.values() if (one.jog.controller, one.jog.axis) == (wanted.controller, wanted.axis)]
        for lease in own:
            self._end(lease, lease.held.release)
        if len(self._leases) >= MOST_LEASES:
            raise Refusal(TOO_MANY_JOGS(most=MOST_LEASES))
        held = await self._jogs.begin_jog(wanted)
        if viewer.number not in self.viewers and viewer.number not in self._asked:
            held.drop()
            raise Refusal(VIEWER_HAS_GONE())
        lease = Lease(next(self._lease_numbers), viewer, wanted, held)
        self._leases[lease.number] = lease
        self._say_leases()
        return self._lasting(lease)

    def renew(self, viewer: Viewer, number: int) -> LeaseTerm:
        """Raises `Refusal` for a jog that has ended."""
        lease = self._lease(viewer, number)
        try:
            lease.held.extend()
        except SteptwinError:
            self._end(lease, lease.held.release)
            raise
        return self._lasting(lease)

    def let_go(self, viewer: Viewer, number: int) -> None:
        """Nothing for a jog that has ended."""
        if number in self._leases:
            lease = self._lease(viewer, number)
            self._end(lease, lease.held.release)

    def _lease(self, viewer: Viewer, number: int) -> Lease:
        lease = self._leases.get(number)
        if lease is None or lease.viewer.number != viewer.number:
            raise Refusal(LEASE_HAS_ENDED(number=number))
        return lease

    def _lasting(self, lease: Lease) -> LeaseTerm:
        """In milliseconds of the wall clock."""
        lasts_ms = lease.held.lasts_ns / MILLISECOND / max(self.around.moment().speed, 1.0)
        return LeaseTerm(lease.number, min(int(lasts_ms), LONGEST_LEASE_MS))

    def _drop(self, leases: Sequence[Lease]) -> None:
        for lease in leases:
            self._end(lease, lease.held.drop)

    def _end(self, lease: Lease, end: Callable[[], None]) -> None:
        del self._leases[lease.number]
        self._say_leases()
        try:
            end()
        except SteptwinError as error:  # it lapses by itself
            self.around.on_internal(error)

    def _say_leases(self) -> None:
        self.shared.put("leases", self.leases())

    def leases(self) -> list[dict[str, object]]:
        return [lease.to_json() for lease in self._leases.values()]

    # ------------------------------------------------------------------ what the subject is asked

    async def stop(self, wanted: command.StopAxes) -> Result:
        """A stop ends the jogs of what it stops."""
        self._cut(wanted)
        return await self.subject.do(wanted)

    def _cut(self, stopped: command.StopAxes) -> None:
        for lease in list(self._leases.values()):
            if lease.jog.controller == stopped.controller and stopped.axis in (None, lease.jog.axis):
                self._end(lease, lease.held.cut)

    async def stop_all(self) -> Result:
        """Every dead-man jog ends, too."""
        for lease in list(self._leases.values()):
            self._end(lease, lease.held.cut)
        return await self.subject.do(command.StopAll())

    def present(self) -> tuple[dict[str, object], int]:
        """The state of the subject for the message hello but its description, and the number of the command that has read it."""
        plans = [plan.to_json() for plan in self.subject.plans(filter_of(["plan", "sample"]))]
        self._look_at_standing()
        standing = [to_json(one) for one in self._standing]
        data: dict[str, object] = {**self.subject.present(), "standing": standing, "plans": plans, **self.log.to_json()}
        self.streams.flush()
        return data, self.subject.result_of(None).number

    def read(self, points: Sequence[str]) -> tuple[Reading, ...]:
        if not points:
            raise Misuse(NO_POINTS())
        return self.subject.read(*points)

    async def _present(self, points: Sequence[str]) -> Sequence[Reading]:
        """The present values, also of a device."""
        result = await self.subject.do(command.ReadPoints(tuple(points)))
        return [Reading(**one) for one in result.value]

    async def _configuration(self, controller: str) -> SourceText | None:
        given = self.around.configuration(controller)
        if given is not None or self.around.connections is None:
            return given
        return await self.around.connections.configuration(controller)

    # ------------------------------------------------------------------ time

    def time(self, now: Nanos) -> str:
        """The present moment as text, the same for all viewers that are sent something at ``now``."""
        if self._moment[0] != now:
            self._moment = now, str(self.around.moment().time)
        return self._moment[1]

    def tick(self, now: Nanos) -> None:
        """Called about 30 times a second while there are viewers: reads what is watched, spreads events, sends the clock."""
        self._describe()
        points = self.watches.due(now)
        if points:
            self.watches.put(self.subject.read(*points))
        self.shared.put("lost", self.subject.lost)
        pieces = self.subject.workpieces()
        if pieces is not self._workpieces:
            self._workpieces = pieces
            self.shared.put("workpieces", [to_json(one) for one in pieces])
        if now >= self._standing_due:
            self._standing_due = now + STANDING_NS
            self._look_at_standing()
        self.streams.flush()
        over = [lease for lease in self._leases.values() if lease.held.over is not None]
        for lease in over:
            del self._leases[lease.number]
        if over:
            self._say_leases()
        holder = self.control.holder
        if holder is not None and now - self._asked.get(holder.number, now) > IDLE_NS:
            del self._asked[holder.number]
            self.release_control(holder)
        self._look_at_clock(now)

    def _look_at_standing(self) -> None:
        standing = (*self.subject.standing(), *self._gateways_down())
        if standing != self._standing:
            self._standing = standing
            self.shared.put("standing", [to_json(one) for one in standing])

    def _gateways_down(self) -> Iterator[StandingState]:
        for one in () if self.around.services is None else self.around.services.gateways():
            if one.is_up:
                self._gateways[one.place] = None
                continue
            if one.place in self._gateways and self._gateways[one.place] is None:
                self._gateways[one.place] = self.around.moment().time
            yield StandingState(StandingKind.GATEWAY, one.kind, one.text, self._gateways.get(one.place), None)

    def _look_at_clock(self, now: Nanos) -> None:
        moment = self.around.moment()
        goes = moment.running, moment.speed
        if goes != self._running or now >= self._clock_due:
            self._running, self._clock_due = goes, now + CLOCK_NS
            self.shared.repeat("clock", moment.to_json())  # where time stands, too: pages see that the studio is there

"""Subject of a studio and its surroundings: its subject, and the parts that it is given by the program that serves it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, NamedTuple, Protocol

from steptwin.access.audit import Audit
from steptwin.access.tokens import AccessGate
from steptwin.controller import Nanos
from steptwin.devices.digitalshadow import ShadowState
from steptwin.diagnostics import SourceText
from steptwin.studio.branchrequests import Branches
from steptwin.studio.campaignrequests import Campaigns, CampaignTexts
from steptwin.studio.drawingrequests import Arrangement
from steptwin.studio.modelfiles import ModelFiles
from steptwin.studio.programs import ProgramTexts
from steptwin.studio.recordingrequests import RecordingFiles, Recordings
from steptwin.studio.requests import LineUse
from steptwin.studio.servicerequests import WorldServices
from steptwin.studio.timetravel import TimeTravel
from steptwin.studio.workrequests import Work
from steptwin.subject.contract import AsyncSubject, Result
from steptwin.subject.scene import WorkpieceState
from steptwin.subject.standing import StandingState


class PresentMoment(NamedTuple):
    """The present moment of a subject and the speed of its time; ``speed`` infinite: as fast as possible."""

    time: Nanos
    running: bool
    speed: float

    def to_json(self) -> dict[str, object]:
        return {"time_ns": str(self.time), "running": self.running, "speed": "max" if self.speed == inf else self.speed}


class Served(AsyncSubject, Protocol):
    """The subject of the studio. `do` awaits only `steptwin.later.Later`."""

    @property
    def lost(self) -> str | None:
        """The reason why a device does not respond; None while all devices respond."""
        ...

    def result_of(self, value: object) -> Result:
        """A result, at the present moment, of a request that is not a command of the subject."""
        ...

    def present(self) -> dict[str, Any]:
        """``state`` by controller, ``faults``, ``workpieces`` and ``standing``, if known."""
        ...

    def workpieces(self) -> Sequence[WorkpieceState]:
        """As `steptwin.subject.contract.PlannedSubject.workpieces`; none of a device."""
        ...

    def standing(self) -> Sequence[StandingState]:
        """As `steptwin.subject.contract.PlannedSubject.standing`; nothing of a device."""
        ...


class Connections(Protocol):
    """Connects and disconnects devices of the subject. Awaits only `steptwin.later.Later`."""

    @property
    def kinds(self) -> Sequence[Mapping[str, object]]:
        """Kinds of devices that can be connected, that of an address without ``kind`` first: ``kind``, ``model``, ``options`` of
        their addresses, and whether they can be searched for."""
        ...

    async def ports(self) -> Sequence[Mapping[str, object]]:
        """``address`` and ``what`` of the serial ports of this computer."""
        ...

    async def connect(self, address: str, name: str | None) -> str:
        """Connect a device; returns its controller name. Raises `Misuse`, `Refusal`, `LineFailure`."""
        ...

    async def disconnect(self, controller: str) -> None:
        """Disconnect a device. Raises `Misuse` for a controller that is not a device."""
        ...

    async def settings(self, controller: str) -> str:
        """As text. Raises as `disconnect`, `Refusal` and `LineFailure`."""
        ...

    async def configuration(self, controller: str) -> SourceText | None:
        """The configuration file with which a device was connected; None without one. Raises `Misuse`."""
        ...

    async def shadow(self, controller: str, *, on: bool) -> None:
        """Begin the digital shadow of a device, or end it. Raises as `settings`."""
        ...

    def shadow_of(self, controller: str, after: Nanos) -> ShadowState | None:
        """None without a digital shadow. Raises `Misuse`."""
        ...


class LongWork(Protocol):
    """Searches for devices and checks of one, one at a time."""

    def scan(self, places: Sequence[str], kind: str, units: str, baud: str | None, timeout: float) -> None:
        """Begin a search. Raises `Misuse`, and `Refusal` while another work is running."""
        ...

    def verify(self, address: str, *, write: bool) -> None:
        """Begin the checks of a device. Raises `Refusal` while another work is running."""
        ...

    @property
    def last(self) -> Work | None:
        """The work that was begun last."""
        ...

    def cancel(self) -> None: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """Parts that a hub is given besides its subject."""

    moment: Callable[[], PresentMoment]
    gate: AccessGate
    audit: Audit
    program: str
    """Version of steptwin."""
    programs: ProgramTexts
    connections: Connections | None = None
    """None where no device can be connected."""
    work: LongWork | None = None
    """As ``connections``; None also where there are no threads."""
    configuration: Callable[[str], SourceText | None] = lambda controller: None
    """The configuration file of a twin by name; None without one."""
    time_travel: TimeTravel | None = None
    """The past, where one is kept."""
    recordings: Recordings | None = None
    """None without a world."""
    recording_files: RecordingFiles | None = None
    """None where recordings are in no folder."""
    branches: Branches | None = None
    """None without a world."""
    show_branch: Callable[[int], object] | None = None
    """Shows a branch in place of the world; None where it has a page of its own. Raises `Misuse`, `Refusal`."""
    leave_world: Callable[[], object] | None = None
    """Shows the world again in whose place this one is; None where it is in no place of another one."""
    arrangement: Arrangement | None = None
    """None without a world."""
    models: ModelFiles | None = None
    """None without a world whose description is in a file."""
    services: WorldServices | None = None
    """None without a world."""
    campaigns: Campaigns | None = None
    """None without a world whose description is in a file."""
    campaign_texts: CampaignTexts | None = None
    """None where the texts of campaigns are in files."""
    traffic: Callable[[], tuple[LineUse, ...]] | None = None
    """None without a world."""
    on_internal: Callable[[Exception], object] = lambda error: None

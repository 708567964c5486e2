"""Requests for campaigns: thousands of runs of the world of a studio, beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.fields import Meaning
from steptwin.messages import Message
from steptwin.studio.requesttype import request

MOST_CAUSES = 100
CAMPAIGN_IS_RUNNING = Message("studio.campaign-is-running", "{name} runs: one campaign at a time")
UNKNOWN_CAMPAIGN = Message("studio.unknown-campaign", "no campaign {name!r}: there are {names}")


@dataclass(frozen=True, slots=True)
class PropertyResult:
    """Outcome of a property in all runs."""

    name: str
    failed: Annotated[int, "Runs in which it did not hold."]
    robustness: Annotated[float | None, "The least one: how far from violated, -1 to 1; negative where it was violated."]


@dataclass(frozen=True, slots=True)
class FailureCause:
    """Runs that fail in the same way."""

    what: Annotated[str, "What failed."]
    where: Annotated[str | None, "The simplest case that fails so, in words."]
    runs: int
    recording: Annotated[str | None, "The simplest run that fails in this way, among the files of the results."]
    timeline: Annotated[str | None, "Of that run."]


@dataclass(frozen=True, slots=True)
class CampaignResult:
    """The result of a campaign that has ended."""

    runs: int
    failed: int
    pass_rate: float | None
    interval: Annotated[tuple[float, ...], "Of the pass rate, 95 %."]
    properties: tuple[PropertyResult, ...]
    causes: tuple[FailureCause, ...]

    @classmethod
    def of(cls, report: Any) -> CampaignResult:
        """As ``report.json`` has it. Raises what Python does where it is none."""
        properties = [PropertyResult(name, one["failed"], one["robustness"]) for name, one in report["properties"].items()]
        causes = tuple(map(_cause, report["causes"][:MOST_CAUSES]))
        interval = tuple(report["interval"])
        return cls(report["runs"], report["failed"], report["pass_rate"], interval, tuple(properties), causes)


def _cause(one: Mapping[str, Any]) -> FailureCause:
    files = one["files"]
    return FailureCause(one["what"], one["where"], one["count"], files.get("session"), files.get("timeline"))


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignState:
    """A campaign and its progress."""

    campaign: Annotated[str, "Path of its file from the folder of the description."]
    name: str
    results: Annotated[str, "Path of the folder of its results, for GET /api/campaigns/RESULTS/report.html."]
    error: Annotated[str | None, "Why its file cannot be read, or why it did not run."]
    is_running: Annotated[bool, "Whether this studio runs it at present."] = False
    done: Annotated[int, "Runs whose results are there."] = 0
    failed: Annotated[int, "Those of them that failed."] = 0
    total: Annotated[int | None, "How many runs it has, where its file says so."]
    changed: Annotated[str | None, "When its results changed last: wall clock, ISO 8601."] = None
    result: Annotated[CampaignResult | None, "Of the last one that ended; its report is among the files."] = None
    text: Annotated[str | None, "Its text, where change_campaign changes it."] = None


class Campaigns(Protocol):
    """Campaigns of one description of a world. Awaits only `steptwin.later.Later`."""

    async def list(self) -> Sequence[CampaignState]: ...

    async def run(self, campaign: str) -> None:
        """Raises `Misuse` where there is no such campaign, `Refusal` while one runs."""
        ...

    async def end(self, campaign: str) -> None:
        """Nothing where it does not run here."""
        ...

    async def file(self, name: str) -> str:
        """The path of a file of results, which begins with ``results`` of a campaign. Raises `Misuse`."""
        ...


class CampaignTexts(Protocol):
    """Campaigns whose texts are in no file."""

    async def change(self, campaign: str, text: str | None) -> None:
        """None: the text that it had at first. Raises `Misuse` where there is no such campaign, `Refusal` while it runs."""
        ...


_Name: TypeAlias = Annotated[str, Meaning("As in the answer to campaigns.")]


@request(
    "campaigns",
    LOOK,
    "The campaigns of this world: files with a table [campaign] in the folder of its description or just below it.",
    tuple[CampaignState, ...],
)
@dataclass(frozen=True, slots=True)
class ListCampaigns:
    pass


@request(
    "run_campaign",
    KEEP,
    "Run a campaign, or what is left of it, in processes beside the studio. Nothing changes in the world here.",
)
@dataclass(frozen=True, slots=True)
class RunCampaign:
    campaign: _Name


@request("end_campaign", KEEP, "End a campaign; run_campaign goes on with it.")
@dataclass(frozen=True, slots=True)
class EndCampaign:
    campaign: _Name


CampaignRequest: TypeAlias = ListCampaigns | RunCampaign | EndCampaign


@request("change_campaign", KEEP, "Change the text of a campaign that is in no file. Another text has no results yet.")
@dataclass(frozen=True, slots=True)
class ChangeCampaign:
    campaign: _Name
    text: Annotated[str | None, Meaning("Left out: the text that it had at first.")] = None

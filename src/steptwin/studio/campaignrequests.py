"""Requests for campaigns: thousands of runs of the world of a studio, beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.fields import Meaning
from steptwin.jsonvalues import FLAG, NUMBER, TEXT, WHOLE, list_of, members, or_null
from steptwin.studio.requesttype import request


class Campaigns(Protocol):
    """Campaigns of one description of a world. Awaits only `steptwin.later.Later`."""

    async def to_json(self) -> Sequence[Mapping[str, object]]:
        """As `_CAMPAIGN`."""
        ...

    async def run(self, campaign: str) -> None:
        """Raises `Misuse` where there is no such campaign, `Refusal` while one runs."""
        ...

    async def end(self, campaign: str) -> None:
        """Nothing where it does not run here."""
        ...

    async def file(self, name: str) -> str:
        """The path of a file of results, which begins with ``results`` of a campaign. Raises `Misuse`."""
        ...


_PROPERTY = members(
    {
        "name": TEXT,
        "failed": {**WHOLE, "description": "Runs in which it did not hold."},
        "robustness": {
            "type": ["number", "null"],
            "description": "The least one: how far from violated, -1 to 1; negative where it was violated.",
        },
    }
)
_CAUSE = members(
    {
        "what": {**TEXT, "description": "What failed."},
        "where": {**or_null(TEXT), "description": "The simplest case that fails so, in words."},
        "runs": WHOLE,
        "recording": {**or_null(TEXT), "description": "The simplest run that fails in this way, among the files of the results."},
        "timeline": {**or_null(TEXT), "description": "Of that run."},
    }
)
_RESULT = members(
    {
        "runs": WHOLE,
        "failed": WHOLE,
        "pass_rate": {"type": ["number", "null"]},
        "interval": {**list_of(NUMBER), "description": "Of the pass rate, 95 %."},
        "properties": list_of(_PROPERTY),
        "causes": list_of(_CAUSE),
    }
)
_CAMPAIGN = members(
    {
        "campaign": {**TEXT, "description": "Path of its file from the folder of the description."},
        "name": TEXT,
        "results": {**TEXT, "description": "Path of the folder of its results, for GET /api/campaigns/RESULTS/report.html."},
        "error": {**or_null(TEXT), "description": "Why its file cannot be read, or why it did not run."},
        "is_running": {**FLAG, "description": "Whether this studio runs it at present."},
        "done": {**WHOLE, "description": "Runs whose results are there."},
        "failed": {**WHOLE, "description": "Those of them that failed."},
        "total": {**or_null(WHOLE), "description": "How many runs it has, where its file says so."},
        "changed": {**or_null(TEXT), "description": "When its results changed last: wall clock, ISO 8601."},
        "result": {**or_null(_RESULT), "description": "Of the last one that ended; its report is among the files."},
    }
)


_Name: TypeAlias = Annotated[str, Meaning("As in the answer to campaigns.")]


@request(
    "campaigns",
    LOOK,
    "The campaigns of this world: files with a table [campaign] in the folder of its description or just below it.",
    list_of(_CAMPAIGN),
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

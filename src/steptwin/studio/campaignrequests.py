"""Requests for campaigns: thousands of runs of the world of a studio, beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from steptwin.access.roles import KEEP, LOOK
from steptwin.studio.requestrow import NOTHING, RequestRow
from steptwin.subject.fields import TEXT, Field, Schema
from steptwin.subject.shapes import members


@dataclass(frozen=True, slots=True)
class ListCampaigns:
    """The campaigns beside the description of the world, with their progress."""


@dataclass(frozen=True, slots=True)
class RunCampaign:
    """Runs a campaign, or what is left of it."""

    campaign: str


@dataclass(frozen=True, slots=True)
class EndCampaign:
    """Ends a campaign that runs; its results stay."""

    campaign: str


CampaignRequest: TypeAlias = ListCampaigns | RunCampaign | EndCampaign


class Campaigns(Protocol):
    """Of one description of a world. Awaits only `steptwin.later.Later`."""

    async def plain(self) -> Sequence[Mapping[str, object]]:
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


_TEXT: Schema = {"type": "string"}
_WHOLE: Schema = {"type": "integer"}


def _or_null(schema: Schema) -> Schema:
    return {"anyOf": [schema, {"type": "null"}]}


_PROPERTY = members(
    {
        "name": _TEXT,
        "failed": {**_WHOLE, "description": "Runs in which it did not hold."},
        "robustness": {
            "type": ["number", "null"],
            "description": "The least one: how far from violated, -1 to 1; negative where it was violated.",
        },
    }
)
_CAUSE = members(
    {
        "what": {**_TEXT, "description": "What failed."},
        "where": {**_or_null(_TEXT), "description": "The simplest case that fails so, in words."},
        "runs": _WHOLE,
        "session": {**_or_null(_TEXT), "description": "The simplest run that fails in this way, among the files of the results."},
        "timeline": {**_or_null(_TEXT), "description": "Of that run."},
    }
)
_RESULT = members(
    {
        "runs": _WHOLE,
        "failed": _WHOLE,
        "pass_rate": {"type": ["number", "null"]},
        "interval": {"type": "array", "items": {"type": "number"}, "description": "Of the pass rate, 95 %."},
        "properties": {"type": "array", "items": _PROPERTY},
        "causes": {"type": "array", "items": _CAUSE},
    }
)
_CAMPAIGN = members(
    {
        "campaign": {**_TEXT, "description": "Path of its file from the folder of the description."},
        "name": _TEXT,
        "results": {**_TEXT, "description": "Path of the folder of its results, for GET /api/campaigns/RESULTS/report.html."},
        "error": {**_or_null(_TEXT), "description": "Why its file cannot be read, or why it did not run."},
        "is_running": {"type": "boolean", "description": "Whether this studio runs it at present."},
        "done": {**_WHOLE, "description": "Runs whose results are there."},
        "failed": {**_WHOLE, "description": "Those of them that failed."},
        "total": {**_or_null(_WHOLE), "description": "How many runs it has, where its file says so."},
        "changed": {**_or_null(_TEXT), "description": "When its results changed last: wall clock, ISO 8601."},
        "result": {**_or_null(_RESULT), "description": "Of the last one that ended; its report is among the files."},
    }
)
_NAME = Field("campaign", TEXT, "As in the answer to campaigns.")

CAMPAIGNS = (
    RequestRow(
        "campaigns",
        ListCampaigns,
        LOOK,
        "The campaigns of this world: files with a table [campaign] in the folder of its description or just below it.",
        {"type": "array", "items": _CAMPAIGN},
    ),
    RequestRow(
        "run_campaign",
        RunCampaign,
        KEEP,
        "Run a campaign, or what is left of it, in processes beside the studio. Nothing changes in the world here.",
        NOTHING,
        (_NAME,),
    ),
    RequestRow("end_campaign", EndCampaign, KEEP, "End a campaign; run_campaign goes on with it.", NOTHING, (_NAME,)),
)

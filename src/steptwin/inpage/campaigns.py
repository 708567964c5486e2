"""The campaign of the twin of a page. Another worker of the page runs it (`steptwin.inpage.jobs`)."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import PurePosixPath
from typing import Any, Protocol

from steptwin.errors import Misuse, Refusal
from steptwin.messages import Message
from steptwin.studio.campaignrequests import CAMPAIGN_IS_RUNNING, UNKNOWN_CAMPAIGN, CampaignResult, CampaignState

CAMPAIGN = "campaign.toml"
RESULTS = "campaign.results"
TEMPLATE = """\
# Runs this machine many times, each time a little different.

[campaign]
world = "{world}"
runs = 20
end = "10 s"

# [[vary]]                # a value of the description
# path = "x.friction"
# between = [0.0, 0.4]

# [[property]]            # what must hold in each run
# name = "stays on the table"
# always = "x.position < 700"
"""
"""The text for a machine to which none belongs."""
RESULTS_ARE_IN_THE_PAGE = Message("inpage.results-are-in-the-page", "{name}: the page itself has the files of results")


class CampaignPage(Protocol):
    """Page with a worker that runs one campaign at a time; it answers with `PageCampaigns.take`."""

    def runJob(self, job: Mapping[str, object]) -> None:  # noqa: N802  as the page names it
        """``job``: the arguments of `steptwin.inpage.jobs.PageJobs.run`."""
        ...

    def endJob(self) -> None:  # noqa: N802
        """End the worker, whatever it does."""
        ...


class PageCampaigns:
    """See `steptwin.studio.campaignrequests.Campaigns`, and `CampaignTexts` there. There is one; its results last as long as the
    twin. ``machine`` gives the files of its description and programs as they are then, and raises `Misuse` without."""

    def __init__(self, page: CampaignPage, text: str, machine: Callable[[], Mapping[str, bytes]]) -> None:
        self._page = page
        self._machine = machine
        self._first = text
        self._given: Mapping[str, object] = {}
        """Text and files of the campaign that gave the results."""
        self._known: list[str] = []
        """Results: `steptwin.campaign.results.StoredCase.to_text`."""
        self._state = _begin(text)

    async def list(self) -> Sequence[CampaignState]:
        return [self._state]

    async def change(self, campaign: str, text: str | None) -> None:
        self._check(campaign)
        self._state = _begin(self._first if text is None else text)

    async def run(self, campaign: str) -> None:
        self._check(campaign)
        given = {"text": self._state.text, "files": {**self._machine()}}
        if given != self._given:
            self._given, self._known = given, []
            self._state = _begin(str(self._state.text))
        self._page.runJob({**given, "known": [*self._known]})
        self._state = replace(self._state, is_running=True, error=None)

    async def end(self, campaign: str) -> None:
        if self._state.is_running and campaign == CAMPAIGN:
            self._page.endJob()
            self._state = replace(self._state, is_running=False)

    async def file(self, name: str) -> str:
        raise Misuse(RESULTS_ARE_IN_THE_PAGE(name=name))

    def _check(self, campaign: str) -> None:
        if campaign != CAMPAIGN:
            raise Misuse(UNKNOWN_CAMPAIGN(name=campaign, names=[CAMPAIGN]))
        if self._state.is_running:
            raise Refusal(CAMPAIGN_IS_RUNNING(name=campaign))

    def take(self, news: str) -> None:
        """Take a text that `steptwin.inpage.jobs.JobsPage.tell` was given."""
        if not self._state.is_running:
            return
        found = json.loads(news)
        if "results" in found:
            self._known += found["results"]
            now = datetime.now(UTC).isoformat(timespec="seconds")
            self._state = replace(self._state, done=found["done"], failed=found["failed"], changed=now)
        else:
            result = CampaignResult.of(found["report"]) if "report" in found else None
            self._state = replace(self._state, is_running=False, error=found.get("error"), result=result)


def _begin(text: str) -> CampaignState:
    """The state of a campaign that has not run."""
    table: Any = {}
    error: str | None = None
    try:
        table = tomllib.loads(text).get("campaign", {})
    except (ValueError, RecursionError) as wrong:
        error = str(wrong)
    name, runs = (table.get(key) if isinstance(table, dict) else None for key in ("name", "runs"))
    return CampaignState(
        campaign=CAMPAIGN,
        name=name if isinstance(name, str) else PurePosixPath(CAMPAIGN).stem,
        results=RESULTS,
        error=error,
        total=runs if isinstance(runs, int) else None,
        text=text,
    )

"""The jobs' worker of a page: it runs a campaign, and has nothing else to do. Who wants to end that ends the worker."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.description import CampaignDescription
from steptwin.campaign.report.write import write_report
from steptwin.campaign.results import MemoryStore, StoredCase
from steptwin.coverage.counts import Coverage
from steptwin.errors import Misuse, SteptwinError
from steptwin.files.textfiles import write_bytes
from steptwin.inpage.campaigns import CAMPAIGN, RESULTS
from steptwin.messages import Message

MOST_RUNS = 200
SHOWN = (".html", ".json", ".xml")
DESIGNS, SEARCHES = ("random", "grid"), ("random", "exhaustive")
"""Those that need no library."""
TOO_MANY = Message(
    "inpage.too-many-runs",
    "{count} runs: a page runs at most {most}, one after the other; 'steptwin campaign run' on a computer runs any number",
)
NO_NUMBER = Message("inpage.no-number-of-runs", "runs: not given; a page runs 1 to {most}")
NEEDS = Message(
    "inpage.campaign-needs",
    "{what}: a page has no library for this; 'steptwin campaign run' on a computer does it. Permitted here: {permitted}",
)
NO_DATABASE = Message("inpage.no-database", "database: a page reaches none; leave it out")


class JobsPage(Protocol):
    """Messages to a page. ``files``: those of results, by name, with the last one of a campaign."""

    def tell(self, news: str, files: Mapping[str, bytes]) -> None: ...


class PageJobs:
    """Runs campaigns, in the present folder, which nobody else has."""

    def __init__(self, page: JobsPage) -> None:
        self._page = page

    def run(self, text: str, files: Mapping[str, bytes | memoryview], known: Sequence[str]) -> None:
        """Run what is left of a campaign. ``files``: those of its world; ``known``: results that are there."""
        shutil.rmtree(RESULTS, ignore_errors=True)
        try:
            report, made = self._run(text, files, known)
        except SteptwinError as error:
            self._page.tell(json.dumps({"error": str(error)}), {})
        else:
            self._page.tell(json.dumps({"report": report}), made)

    def _run(
        self, text: str, files: Mapping[str, bytes | memoryview], known: Sequence[str]
    ) -> tuple[object, Mapping[str, bytes]]:
        for name, content in {**files, CAMPAIGN: text.encode()}.items():
            write_bytes(Path(name), bytes(content))
        campaign = Campaign.load(CAMPAIGN)
        check_small(campaign.description)
        check_count(campaign.count)
        folder = Path(RESULTS)
        campaign.memory = _ToldStore([StoredCase.from_text(one) for one in known], self._page)
        report = write_report(campaign, campaign.run(folder), folder, None)
        # Somebody has the page alone, without the files beside it.
        alone = replace(report, found=[replace(one, files=None) for one in report.found]).html(folder)
        write_bytes(folder / "report.html", alone.encode())
        found = (file for file in folder.rglob("*") if file.suffix in SHOWN)
        return report.to_json(folder), {file.as_posix(): file.read_bytes() for file in found}


class _ToldStore(MemoryStore):
    """Tells the page what has been added to what was known."""

    def __init__(self, known: Sequence[StoredCase], page: JobsPage) -> None:
        super().__init__()
        super().add(known)
        self._page = page

    def add(self, found: Sequence[StoredCase], coverage: Coverage | None = None) -> None:
        super().add(found, coverage)
        texts = [one.to_text() for one in found]
        self._page.tell(json.dumps({"done": len(self.numbers()), "failed": self.failed(), "results": texts}), {})


def check_small(description: CampaignDescription) -> None:
    """Raises `Misuse` for what needs libraries or services that no page has."""
    for key, value, permitted in (("design", description.design, DESIGNS), ("search", description.search, SEARCHES)):
        if value not in permitted:
            raise Misuse(NEEDS(what=f'{key} = "{value}"', permitted=list(permitted)))
    if description.database is not None:
        raise Misuse(NO_DATABASE())


def check_count(count: int | None) -> None:
    """Raises `Misuse` for more runs than a page has."""
    if count is None:
        raise Misuse(NO_NUMBER(most=MOST_RUNS))
    if count > MOST_RUNS:
        raise Misuse(TOO_MANY(count=count, most=MOST_RUNS))

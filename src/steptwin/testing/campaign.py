"""A campaign inside of a test."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.report.campaignpage import cause_text
from steptwin.campaign.report.write import write_report
from steptwin.campaign.summary import CampaignSummary
from steptwin.errors import Misuse


@dataclass(frozen=True, slots=True)
class CampaignMarker:
    """The options of ``@pytest.mark.steptwin_campaign``. ``out``: the folder of the results, relative to that of the test; else
    a temporary one."""

    file: str | Path = ""
    runs: int | None = None
    seed: int | None = None
    search: str | None = None
    jobs: int = 1
    out: str | Path | None = None


def run_campaign(options: CampaignMarker, folder: Path, temporary: Path) -> tuple[CampaignSummary, str]:
    """The summary, and what failed for people; empty if nothing did. Raises `Misuse`, `LineFailure`."""
    if not options.file:
        raise Misuse("@pytest.mark.steptwin_campaign: the file of the campaign is missing")
    file = folder / options.file
    out = temporary if options.out is None else folder / options.out
    campaign = Campaign.load(file).changed(runs=options.runs, seed=options.seed, search=options.search)
    summary = campaign.run(out, jobs=options.jobs)
    if not summary.failed:
        return summary, ""
    report = write_report(campaign, summary, out, file)
    causes = "\n".join(f"{len(cause.numbers)} runs: {cause_text(cause)}" for cause in report.found)
    return summary, f"{file.name}: {summary.failed} of {summary.runs} runs failed\n{causes}\n{out / 'report.html'}"

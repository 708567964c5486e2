"""Writes the report of a campaign whose results are in a folder: ``report.html``, ``report.json``, ``junit.xml``, and the files
of each cause in ``failures``."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

from steptwin.campaign.campaign import Campaign
from steptwin.campaign.case import Case, CaseResult
from steptwin.campaign.description import SALTELLI, SEARCHES
from steptwin.campaign.findings import find
from steptwin.campaign.report.campaignpage import CampaignReport
from steptwin.campaign.report.sobolindices import SobolIndex, sobol_indices
from steptwin.campaign.report.statistics import RunColumns, histogram, influences
from steptwin.campaign.summary import CampaignSummary
from steptwin.files.textfiles import write_bytes

SHRINKING_S = 60.0
"""The wall time for making failures simpler."""
MOST_FAILED = 2000
"""Failed runs whose causes are distinguished."""
FAILURES = "failures"


def write_report(campaign: Campaign, summary: CampaignSummary, folder: Path, file: Path | None) -> CampaignReport:
    """``file``: the description, for the tests of what failed. Raises `Misuse`."""
    store = campaign.open_store(folder)
    # Workers went on meanwhile with cases after the first failure: these are no part of the campaign.
    before = summary.failures[-1].number + 1 if campaign.description.until_failure and summary.failures else None
    cases: dict[int, Case] = {}

    def failed() -> Iterator[CaseResult]:
        for case, result in islice(store.results(before, failed=True), MOST_FAILED):
            cases[case.number] = case
            yield result

    try:
        columns = RunColumns.of(store.results(before), [one.do for one in campaign.description.faults])
        end = time.monotonic() + SHRINKING_S
        found = find(
            campaign.runner, failed(), cases.__getitem__, folder / FAILURES, file, is_over=lambda: time.monotonic() > end
        )
    finally:
        store.close()
    units = campaign.units() if columns.measures else {}
    shown = (histogram(name, numbers, _unit(name, units)) for name, numbers in columns.measures.items())
    report = CampaignReport(
        summary=summary,
        found=found,
        influences=influences(columns) if find_spec("scipy") else None,
        indices=_indices(campaign, columns),
        histograms=[one for one in shown if one is not None],
        search=campaign.description.search,
    )
    text = json.dumps(report.to_json(folder), ensure_ascii=False, indent=1) + "\n"
    for name, content in {
        "report.html": report.html(folder).encode(),
        "report.json": text.encode(),
        "junit.xml": report.junit(),
    }.items():
        write_bytes(folder / name, content)
    return report


def _indices(campaign: Campaign, columns: RunColumns) -> list[SobolIndex]:
    description = campaign.description
    if description.design != SALTELLI or description.search != SEARCHES[0]:
        return []
    faults = {f"fault {n}": f"fault {one.do}" for n, one in enumerate(description.faults, 1) if one.chance < 1.0}
    names = [faults.get(one.name, one.name) for one in campaign.cases.dimensions]
    return sobol_indices(names, columns.numbers, columns.robustness, columns.passed)


def _unit(name: str, units: Mapping[str, str]) -> str:
    """Unit of a measure of the description, or of a cycle time of a property."""
    return units.get(name, "" if name.endswith(" cycles") else "s")

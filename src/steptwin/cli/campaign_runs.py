"""``steptwin campaign``: runs campaigns and shows their results."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from steptwin.campaign.campaign import RESULTS, SUFFIX, SUMMARY, Campaign, CampaignProgress
from steptwin.campaign.report import comparison
from steptwin.campaign.report.campaignpage import cause_text
from steptwin.campaign.report.write import write_report
from steptwin.campaign.summary import percent
from steptwin.errors import Misuse
from steptwin.extras import libraries_of, missing
from steptwin.files.coverage import CoverageReports
from steptwin.files.textfiles import check_writable, new_file
from steptwin.inputfiles import read_recorded

Print = Callable[[str], object]
MOST_LINES = 20
"""Failing cases that are printed."""
EXPORT = ".parquet"


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignOptions:
    """The options of a campaign; None: as its file says."""

    file: Path
    out: Path | None
    """None: beside the file, under its name with ``.results``."""
    runs: int | None = None
    seed: int | None = None
    time: str | None = None
    until_failure: bool | None = None
    search: str | None = None
    jobs: int | None = None
    dask: str | None = None
    coverage: Sequence[str] = ()
    export: Path | None = None
    as_json: bool = False


def run(options: CampaignOptions, out: Print) -> bool:
    """Run a campaign, or what is left of it. Returns whether all runs passed. Raises `Misuse`, `LineFailure`."""
    reports = CoverageReports(options.coverage)
    if options.export is not None:
        _check_export(options.export)
    campaign = Campaign.load(options.file).changed(
        runs=options.runs, seed=options.seed, time=options.time, until_failure=options.until_failure, search=options.search
    )
    folder = options.out or options.file.with_suffix(SUFFIX)
    began = time.monotonic()
    with _progress(campaign) as progress:
        summary = campaign.run(folder, jobs=options.jobs, dask=options.dask, coverage=bool(options.coverage), progress=progress)
    report = write_report(campaign, summary, folder, options.file)
    if options.as_json:
        out(_json(summary.plain()))
    else:
        _print(summary.plain(), out, [f"cause, {len(one.numbers)} runs: {cause_text(one)}" for one in report.found])
        out(f"{time.monotonic() - began:.1f} s; results in {folder}, report.html shows them")
    reports.add(campaign.coverage, options.file.parent)
    tables: list[str] = []
    reports.write(tables.append)
    for text in () if options.as_json else tables:
        out(f"\n{text}")
    if options.coverage and campaign.covered < summary.runs and not options.as_json:
        out(f"coverage is that of {campaign.covered} of the runs: the others were before it was asked for")
    if options.export is not None:
        _export(campaign, folder, options.export)
    return not summary.failed


def show(folder: Path, out: Print, *, as_json: bool) -> bool:
    """Print the summary that is in a folder. Returns whether all runs passed. Raises `Misuse`."""
    path = folder / SUMMARY
    if not path.is_file():
        raise Misuse(
            f"{folder} has no {SUMMARY}: "
            + ("its campaign has not ended, run it again to go on" if (folder / RESULTS).exists() else "it has no results")
        )
    try:
        plain = json.loads(read_recorded(path))
        text = _json(plain)
        lines: list[str] = []
        _print(plain, lines.append)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise error if isinstance(error, Misuse) else Misuse(f"{path} is no summary of a campaign") from None
    for line in [text] if as_json else lines:
        out(line)
    return not plain["failed"]


def compare(before: Path, after: Path, out: Print, *, as_json: bool) -> bool:
    """Print what differs between two folders of results. Returns whether it did not become worse. Raises `Misuse`."""
    found = comparison.compare(before, after)
    for line in [_json(found)] if as_json else comparison.lines(found):
        out(line)
    return found["verdict"] != "worse"


def _json(plain: Any) -> str:
    return json.dumps(plain, ensure_ascii=False, indent=2)


def _print(plain: Any, out: Print, causes: Sequence[str] = ()) -> None:
    runs, failed = plain["runs"], plain["failed"]
    low, high = plain["interval"]
    if not runs:
        out(f"{plain['name']}: no runs")
        return
    out(f"{plain['name']}: {runs} runs, {failed} failed: {percent(plain['pass_rate'])} pass (95 %: {low:.2%} to {high:.2%})")
    for name, one in plain["properties"].items():
        worst = "" if one["robustness"] is None else f"; least robustness {one['robustness']:.4g} in case {one['case']}"
        held = f"violated in {one['failed']}" if one["failed"] else "holds"
        out(f"  {name}: {held}{worst}")
    for one in plain["failures"][:MOST_LINES]:
        out(f"case {one['number']}: {_given(one['case'])}: {one['why']}")
    if failed > MOST_LINES:
        out(f"... and {failed - MOST_LINES} more: {SUMMARY} has the first 1000, the database all")
    for cause in causes:
        out(cause)
    out(f"seed {plain['seed']}, digest {plain['digest']}")


def _given(case: Any) -> str:
    """What is particular to a case."""
    values = [f"{name} = {value}" for name, value in case["values"].items()]
    faults = [f"{one['fault']} at {one['at_ns'] / 1e9:g} s" for one in case["faults"]]
    return ", ".join([*values, *faults]) or f"seed {case['seed']}"


@contextmanager
def _progress(campaign: Campaign) -> Generator[Callable[[CampaignProgress], object]]:
    """A bar on standard error with the rate and the time that is left, if that is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[more]}"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(campaign.description.name, total=None, more="")

        def show_progress(progress: CampaignProgress) -> None:
            more = f"{progress.failed} failed, {progress.rate:.0f}/s"
            bar.update(task, completed=progress.done, total=progress.total, more=more)

        yield show_progress


def _check_export(path: Path) -> None:
    from importlib.util import find_spec

    if path.suffix.lower() != EXPORT:
        raise Misuse(f"--export {path}: the name must end with {EXPORT}")
    if find_spec("pyarrow") is None:
        raise missing("--export", libraries_of("campaign"))
    check_writable(path)


def _export(campaign: Campaign, folder: Path, path: Path) -> None:
    from steptwin.campaign.parquet import write_cases

    store = campaign.open_store(folder)
    try:
        with new_file(path) as file:
            write_cases(store.results, file)
    finally:
        store.close()

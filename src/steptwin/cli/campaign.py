"""``steptwin campaign``: many runs of a world, each a little different.

From Python: `steptwin.campaign.campaign.Campaign`.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from steptwin.cli.commandgroup import CommandGroup
from steptwin.cli.device import Json
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.campaign.campaign import Campaign, CampaignProgress
    from steptwin.campaign.faultmatrix import FaultMatrix


command = typer.Typer(
    cls=CommandGroup,
    add_completion=False,
    rich_markup_mode=None,
    no_args_is_help=True,
    help="Run campaigns: many runs of a world, each a little different.",
)

Print = Callable[[str], object]
MOST_LINES = 20
"""Failing cases that are printed."""
EXPORT = ".parquet"


File = Annotated[Path, typer.Argument(metavar="FILE", help="The campaign, TOML.")]


@command.command("run")
def run(
    file: File,
    runs: Annotated[int | None, typer.Option(help="Number of runs. Default: that of the file.")] = None,
    jobs: Annotated[int | None, typer.Option(help="Number of processes. Default: one for each processor.")] = None,
    dask: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address of a Dask cluster, such as tcp://HOST:8786; 'local' starts one."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Random seed. Default: that of the file.")] = None,
    time: Annotated[
        str | None, typer.Option(metavar="TIME", help="Begin no more runs after this time, such as '10 min'.")
    ] = None,
    until_failure: Annotated[bool, typer.Option("--until-failure", help="End after the first run that fails.")] = False,
    search: Annotated[
        str | None,
        typer.Option(
            metavar="[random|exhaustive|guided]", help="Method that selects the cases. Default: that of the file, or random."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="DIR", help="Folder for the results. Default: FILE with .results.")
    ] = None,
    coverage: Annotated[
        list[str] | None,
        written(metavar="FILE", help="Coverage of the programs: .info, .html or .json; - for a table."),
    ] = None,
    export: Annotated[Path | None, written(metavar="FILE", help="All runs as a table, .parquet.")] = None,
    json: Json = False,
) -> None:
    """Run a campaign, or what is left of one that was interrupted. The results are the same for any number of processes.

    Exit code 1 when a property failed in a run.
    """
    options = CampaignOptions(
        file=file,
        out=out,
        runs=runs,
        seed=seed,
        time=time,
        until_failure=True if until_failure else None,
        search=search,
        jobs=jobs,
        dask=dask,
        coverage=tuple(coverage or ()),
        export=export,
        as_json=json,
    )
    if not _run(options, typer.echo):
        raise typer.Exit(1)


@command.command("faults")
def faults(
    file: File,
    jobs: Annotated[int | None, typer.Option(help="Number of processes. Default: one for each processor.")] = None,
    phases: Annotated[int | None, typer.Option(help="Largest number of phases. Default: that of the file, or 16.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder for the table and the recordings. Default: FILE with .faults."),
    ] = None,
    json: Json = False,
) -> None:
    """Try every fault of sensors, actuators, logic, lines and power in every phase of the cycle: how does the machine react?

    Writes faults.html, faults.csv and a recording of each run. Exit code 1 when one was unsafe, or when the run without a fault,
    which comes first, does not hold.
    """
    if not _faults(file, out, typer.echo, jobs=jobs, phases=phases, as_json=json):
        raise typer.Exit(1)


@command.command("compare")
def compare(
    before: Annotated[Path, typer.Argument(metavar="DIR1", help="Folder of the results before.")],
    after: Annotated[Path, typer.Argument(metavar="DIR2", help="Folder of the results after.")],
    json: Json = False,
) -> None:
    """Compare two campaigns, such as before and after a change of the program. Exit code 1 when it became worse."""
    if not _compare(before, after, typer.echo, as_json=json):
        raise typer.Exit(1)


@command.command("show")
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the results.")],
    json: Json = False,
) -> None:
    """Show the summary of a campaign. Exit code 1 when a property failed in a run."""
    if not _show(folder, typer.echo, as_json=json):
        raise typer.Exit(1)


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


def _run(options: CampaignOptions, out: Print) -> bool:
    """Run a campaign, or what is left of it. Returns whether all runs passed. Raises `Misuse`, `LineFailure`."""
    from steptwin.campaign.campaign import SUFFIX, Campaign
    from steptwin.campaign.report.campaignpage import cause_text
    from steptwin.campaign.report.write import write_report
    from steptwin.files.coverage import CoverageReports

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
        out(_json(summary.to_json()))
    else:
        _print(summary.to_json(), out, [f"cause, {len(one.numbers)} runs: {cause_text(one)}" for one in report.found])
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


def _show(folder: Path, out: Print, *, as_json: bool) -> bool:
    """Print the summary that is in a folder. Returns whether all runs passed. Raises `Misuse`."""
    from steptwin.campaign.campaign import RESULTS, SUMMARY
    from steptwin.inputfiles import read_recorded

    path = folder / SUMMARY
    if not path.is_file():
        raise Misuse(
            f"{folder} has no {SUMMARY}: "
            + ("its campaign has not ended, run it again to go on" if (folder / RESULTS).exists() else "it has no results")
        )
    try:
        data = json.loads(read_recorded(path))
        text = _json(data)
        lines: list[str] = []
        _print(data, lines.append)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise error if isinstance(error, Misuse) else Misuse(f"{path} is not a summary of a campaign") from None
    for line in [text] if as_json else lines:
        out(line)
    return not data["failed"]


def _compare(before: Path, after: Path, out: Print, *, as_json: bool) -> bool:
    """Print what differs between two folders of results. Returns whether it did not become worse. Raises `Misuse`."""
    from steptwin.campaign.report import comparison

    found = comparison.compare(before, after)
    for line in [_json(found)] if as_json else comparison.lines(found):
        out(line)
    return found["verdict"] != "worse"


def _json(data: Any) -> str:
    return json.dumps(data, ensure_ascii=False, indent=2)


def _print(data: Any, out: Print, causes: Sequence[str] = ()) -> None:
    from steptwin.campaign.campaign import SUMMARY
    from steptwin.campaign.summary import percent

    runs, failed = data["runs"], data["failed"]
    low, high = data["interval"]
    if not runs:
        out(f"{data['name']}: no runs")
        return
    out(f"{data['name']}: {runs} runs, {failed} failed: {percent(data['pass_rate'])} pass (95 %: {low:.2%} to {high:.2%})")
    for name, one in data["properties"].items():
        worst = "" if one["robustness"] is None else f"; least robustness {one['robustness']:.4g} in case {one['case']}"
        held = f"violated in {one['failed']}" if one["failed"] else "holds"
        out(f"  {name}: {held}{worst}")
    for one in data["failures"][:MOST_LINES]:
        out(f"case {one['number']}: {_given(one['case'], data.get('times', ()))}: {one['why']}")
    if failed > MOST_LINES:
        out(f"... and {failed - MOST_LINES} more: {SUMMARY} has the first 1000, the database all")
    for cause in causes:
        out(cause)
    out(f"seed {data['seed']}, digest {data['digest']}")


def _given(case: Any, times: Collection[str]) -> str:
    """Text of the values of a case. ``times``: the names of those that are times."""
    values = [f"{name} = {value:.9g} s" if name in times else f"{name} = {value}" for name, value in case["values"].items()]
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

    from steptwin.extras import missing
    from steptwin.files.textfiles import check_writable

    if path.suffix.lower() != EXPORT:
        raise Misuse(f"--export {path}: the name must end with {EXPORT}")
    if find_spec("pyarrow") is None:
        raise missing("--export", "campaign")
    check_writable(path)


def _export(campaign: Campaign, folder: Path, path: Path) -> None:
    from steptwin.campaign.parquet import write_cases
    from steptwin.files.textfiles import new_file

    store = campaign.open_store(folder)
    try:
        with new_file(path) as file:
            write_cases(store.results, file)
    finally:
        store.close()


MOST_CELLS = 20
"""Unsafe cells that are printed."""


def _faults(file: Path, out: Path | None, write: Print, *, jobs: int | None, phases: int | None, as_json: bool) -> bool:
    """Make the matrix. Returns whether the run without a fault holds and nothing was unsafe. Raises `Misuse`."""
    from steptwin.campaign.description import MOST_PHASES
    from steptwin.campaign.effects import FaultEffect
    from steptwin.campaign.faultmatrix import fault_matrix
    from steptwin.campaign.reading import load_campaign
    from steptwin.campaign.report.matrixpage import write_matrix
    from steptwin.system import reason

    description = load_campaign(file)
    if phases is not None:
        if not 1 <= phases <= MOST_PHASES:
            raise Misuse(f"--phases {phases}: permitted are 1 to {MOST_PHASES}")
        description = replace(description, matrix=replace(description.matrix, phases=phases))
    folder = out or file.with_suffix(".faults")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Misuse(f"--out {folder}: {reason(error)}") from None
    began = time.monotonic()
    matrix = fault_matrix(description, folder, jobs=jobs, progress=_print_progress)
    written = write_matrix(matrix, folder)
    if as_json:
        write(json.dumps(matrix.to_json(), ensure_ascii=False, indent=2))
    else:
        _print_matrix(matrix, write)
        write(f"{time.monotonic() - began:.1f} s; {', '.join(str(path) for path in written)}")
    return not matrix.wrong and not matrix.counts[FaultEffect.UNSAFE]


def _print_progress(done: int, total: int) -> None:
    if sys.stderr.isatty():
        end = "\n" if done == total else ""
        sys.stderr.write(f"\r{done} of {total} faults{end}")
        sys.stderr.flush()


def _print_matrix(matrix: FaultMatrix, write: Print) -> None:
    from steptwin.campaign.effects import FaultEffect

    if matrix.wrong:
        write(f"{matrix.name}: the run without a fault does not hold, so no fault was tried: {matrix.wrong}")
        return
    counts = ", ".join(f"{effect} {count}" for effect, count in matrix.counts.items())
    write(f"{matrix.name}: {len(matrix.rows)} faults at {len(matrix.phases)} phases: {counts}")
    unsafe = [(row, cell) for row in matrix.rows for cell in row.cells if cell.judgement.effect is FaultEffect.UNSAFE]
    for row, cell in unsafe[:MOST_CELLS]:
        write(f"unsafe: {row.function}, {row.possible.mode}, phase {matrix.phases[cell.phase].number}: {cell.judgement.why}")
    if len(unsafe) > MOST_CELLS:
        write(f"... and {len(unsafe) - MOST_CELLS} more unsafe ones")

"""``steptwin campaign``: many runs of a world, each a little different.

From Python: `steptwin.campaign.campaign.Campaign`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli.commandgroup import CommandGroup
from steptwin.cli.device import Json
from steptwin.cli.writtenfiles import written

command = typer.Typer(
    cls=CommandGroup,
    add_completion=False,
    rich_markup_mode=None,
    no_args_is_help=True,
    help="Run campaigns: many runs of a world, each a little different.",
)

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
    from steptwin.cli.campaign_runs import CampaignOptions
    from steptwin.cli.campaign_runs import run as run_campaign

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
    if not run_campaign(options, typer.echo):
        raise typer.Exit(1)


@command.command("faults")
def faults(
    file: File,
    jobs: Annotated[int | None, typer.Option(help="Number of processes. Default: one for each processor.")] = None,
    phases: Annotated[int | None, typer.Option(help="Largest number of phases. Default: that of the file, or 12.")] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder for the table and the sessions. Default: FILE with .faults."),
    ] = None,
    json: Json = False,
) -> None:
    """Try every fault of sensors, actuators, logic, lines and power in every phase of the cycle: how does the machine react?

    Writes faults.html, faults.csv and a session of each run. Exit code 1 when one was unsafe.
    """
    from steptwin.cli.campaign_faults import faults as run_faults

    if not run_faults(file, out, typer.echo, jobs=jobs, phases=phases, as_json=json):
        raise typer.Exit(1)


@command.command("compare")
def compare(
    before: Annotated[Path, typer.Argument(metavar="DIR1", help="Folder of the results before.")],
    after: Annotated[Path, typer.Argument(metavar="DIR2", help="Folder of the results after.")],
    json: Json = False,
) -> None:
    """Compare two campaigns, such as before and after a change of the program. Exit code 1 when it became worse."""
    from steptwin.cli.campaign_runs import compare as compare_folders

    if not compare_folders(before, after, typer.echo, as_json=json):
        raise typer.Exit(1)


@command.command("show")
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the results.")],
    json: Json = False,
) -> None:
    """Show the summary of a campaign. Exit code 1 when a property failed in a run."""
    from steptwin.cli.campaign_runs import show as show_summary

    if not show_summary(folder, typer.echo, as_json=json):
        raise typer.Exit(1)

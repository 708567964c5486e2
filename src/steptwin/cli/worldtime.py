"""The time of a running world, as the commands that change it print it."""

from __future__ import annotations

from typing import Any

import typer

from steptwin.cli.selected import print_data


def print_time(there: dict[str, Any], json: bool) -> None:
    """Print the time of a world: what a twin has sent, or in words."""
    if json:
        print_data(there)
        return
    how, speed = ("paused", "") if there["paused"] else ("running", _how_fast(there["speed"]))
    if there.get("stopped") is not None:
        how, speed = "ended", f" by: {there['stopped']}"
    typer.echo(f"{there['world']} {how} at {there['time_s']:.9f} s{speed}")


def _how_fast(speed: float | str) -> str:
    if speed == "max":
        return ", as fast as possible"
    return "" if speed == 1 else f", {speed:g} virtual seconds a second"

"""Completion in the shell: values of options, names of running twins, their pins, kinds of faults.

Nothing here raises or prints: a value that cannot be determined is not offered.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable

import typer

from steptwin.errors import SteptwinError


def firmwares(incomplete: str) -> list[str]:
    from steptwin.mic488.registers import FIRMWARES

    return _beginning(FIRMWARES, incomplete)


def variants(incomplete: str) -> list[str]:
    from steptwin.m1486.variants import VARIANTS

    return _beginning((variant.name for variant in VARIANTS), incomplete)


def devices(incomplete: str) -> list[str]:
    """Running twins and their controllers by name."""
    from steptwin.live.twins import running_twins

    with contextlib.suppress(SteptwinError):
        twins = running_twins()
        named = {each.full_name: None for twin in twins for each in twin.controllers}
        return _beginning({twin.name: None for twin in twins} | named, incomplete)
    return []


def pins(context: typer.Context, incomplete: str) -> list[str]:
    """``IN1=`` of the twin that ``--device`` names, or of the only one."""
    from steptwin.cli.selected import levels_of, selected

    with contextlib.suppress(SteptwinError), selected(context.params.get("twin")) as there:
        several = len(there.controllers) > 1
        return _beginning((f"{name if several else name.partition('.')[2]}=" for name in levels_of(there)), incomplete)
    return []


def faults(context: typer.Context, incomplete: str) -> list[str]:
    """The kinds of faults, then ``NAME=`` of what the kind takes."""
    from steptwin.simulation.components.registry import fault_kinds

    kinds = fault_kinds()
    words = context.params.get("words") or []
    if not words or words[0] not in kinds:
        return _beginning(kinds, incomplete)
    given = {word.partition("=")[0] for word in words[1:]}
    return _beginning((f"{each.name}=" for each in kinds[words[0]].parameters if each.name not in given), incomplete)


def values(incomplete: str) -> list[str]:
    """Names of values of devices."""
    from steptwin.drivers.kinds import DRIVERS

    return [name for kind in DRIVERS.values() for name in kind.names() if name.startswith(incomplete.upper())]


def _beginning(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]

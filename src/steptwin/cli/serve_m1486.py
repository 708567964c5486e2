"""`steptwin serve m1486`: M1486 chips made from options."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from steptwin.cli.serving import ServeOptions, check_links, serve
from steptwin.languages.chips import Chain, check_chain, parse_addresses, parse_wire, placed_wires
from steptwin.languages.descriptions import Named
from steptwin.live.serving import check_line_timing
from steptwin.m1486.lines import interface
from steptwin.m1486.pins import baud_pins
from steptwin.m1486.variants import DEFAULT, variant
from steptwin.simulation.describe.small_m1486 import m1486_world


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeM1486:
    """The chips, as given; see ``steptwin serve m1486 --help``."""

    variant: str = DEFAULT.name
    chain: str = "F"
    interface: str = "sd"
    wires: tuple[str, ...] = ()
    program: Path | None = None


def serve_m1486(twin: ServeOptions, chips: ServeM1486) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    check_links(twin)
    serve(twin, partial(describe_m1486, twin, chips), describe_m1486(replace(twin, faults=()), chips))


def describe_m1486(twin: ServeOptions, chips: ServeM1486, named: Named = str) -> str:
    """The description of the world to serve. Raises `Misuse` for invalid options."""
    check_line_timing(twin.line_timing, "real")
    kind = variant(chips.variant)
    baud_pins(kind, twin.baud)
    addresses, wires = parse_addresses(chips.chain), [parse_wire(wire) for wire in chips.wires]
    chain = Chain(variant=kind, addresses=addresses, interface=interface(chips.interface), wires=wires)
    check_chain(chain, has_program=chips.program is not None)
    values = {
        "variant": kind.name,
        "interface": chips.interface,
        "program": None if chips.program is None else named(chips.program),
    }
    return m1486_world(twin.whole(), addresses, values, placed_wires(chain))

"""`steptwin serve m1486`: M1486 chips made from options."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from steptwin.commands.chips import Chain, check_chain, parse_addresses, parse_wire, placed_wires
from steptwin.commands.descriptions import Named
from steptwin.commands.serve import ServeOptions, check_links, serve
from steptwin.live.serving import check_line_timing
from steptwin.m1486.lines import interface
from steptwin.m1486.pins import baud_pins
from steptwin.m1486.variants import DEFAULT, variant
from steptwin.world.kinds.m1486.small import m1486_world


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeM1486(ServeOptions):
    """The command's options as given; see ``steptwin serve m1486 --help``."""

    name: str = "m1486"
    variant: str = DEFAULT.name
    chain: str = "F"
    interface: str = "sd"
    wires: tuple[str, ...] = ()
    program: Path | None = None


def serve_m1486(options: ServeM1486) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    check_links(options)
    serve(options, partial(describe_m1486, options), describe_m1486(replace(options, faults=())))


def describe_m1486(options: ServeM1486, named: Named = str) -> str:
    """The description of the world to serve. Raises `Misuse` for invalid options."""
    check_line_timing(options.line_timing, "real")
    kind = variant(options.variant)
    baud_pins(kind, options.baud)
    addresses, wires = parse_addresses(options.chain), [parse_wire(wire) for wire in options.wires]
    chain = Chain(variant=kind, addresses=addresses, interface=interface(options.interface), wires=wires)
    check_chain(chain, has_program=options.program is not None)
    values = {
        "variant": kind.name,
        "interface": options.interface,
        "program": None if options.program is None else named(options.program),
    }
    return m1486_world(options.whole(), addresses, values, placed_wires(chain))

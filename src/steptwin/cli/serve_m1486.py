"""``steptwin serve m1486``: M1486 chips made from options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from steptwin.cli.optiongroups import grouped
from steptwin.cli.serving import LineOptions, Served, TwinOptions, serve
from steptwin.live.options import LiveOptions, LogOptions
from steptwin.options import Option, OptionGroup

if TYPE_CHECKING:
    from steptwin.languages.descriptions import Named

PORTS = {"tcp": 5022}


@dataclass(frozen=True, kw_only=True)
class ChipLineOptions(LineOptions):
    tcp: Annotated[str | None, Option("The line as raw TCP; port 0 takes a free one.", metavar="HOST:PORT")] = None
    baud: Annotated[int | None, Option("Baud rate selected by the BR pins. Default: the highest of the type.")] = None
    line_timing: Annotated[str, Option("'real': characters take their time on the wire; 'off': none.")] = "off"


@dataclass(frozen=True, kw_only=True)
class ChipOptions(OptionGroup):
    """The chips."""

    heading = "Options of the chips"

    variant: Annotated[str, Option("Type: A, B, C, E1, E2, or A2x and so on (24 MHz).", completion="variants")] = "A"
    chain: Annotated[str, Option("Addresses of the chips on the line, such as 0,7; hexadecimal digits.")] = "F"
    interface: Annotated[str, Option("Driver interface: sd, dual or two.")] = "sd"
    wire: Annotated[tuple[str, ...], Option("Wire from a pin of one chip to an input of another: 0.B1=7.B3; repeatable.")] = ()
    program: Annotated[Path | None, Option("Program in the memory of a single chip at power-on.")] = None


@grouped
def m1486(*, chips: ChipOptions, line: ChipLineOptions, twin: TwinOptions, live: LiveOptions, log: LogOptions) -> None:
    """Serve virtual M1486 chips on one line; several clients may be connected to it.

    Without any of --pty, --serial, --tcp and --rfc2217 it listens on a pty and on 127.0.0.1:5022 (raw TCP); with --listen-any
    on all interfaces.
    """
    serve_m1486(Served(kind="m1486", line=line, ports=PORTS, twin=twin, live=live, log=log), chips)


def serve_m1486(served: Served, chips: ChipOptions) -> None:
    served.check_links()
    serve(served, lambda served, named: describe_m1486(served, chips, named))


def describe_m1486(served: Served, chips: ChipOptions, named: Named = str) -> str:
    """The description of the world to serve. Raises `Misuse` for invalid options."""
    from steptwin.languages.chips import Chain, check_chain, parse_addresses, parse_wire, placed_wires
    from steptwin.live.serving import check_line_timing
    from steptwin.m1486.lines import interface
    from steptwin.m1486.pins import baud_pins
    from steptwin.m1486.variants import variant
    from steptwin.simulation.describe.generated_m1486 import m1486_world

    check_line_timing(served.line.line_timing, "real")
    kind = variant(chips.variant)
    baud_pins(kind, served.line.baud)
    addresses, wires = parse_addresses(chips.chain), [parse_wire(wire) for wire in chips.wire]
    chain = Chain(variant=kind, addresses=addresses, interface=interface(chips.interface), wires=wires)
    check_chain(chain, has_program=chips.program is not None)
    values = {
        "variant": kind.name,
        "interface": chips.interface,
        "program": None if chips.program is None else named(chips.program),
    }
    return m1486_world(served.whole(), addresses, values, placed_wires(chain))

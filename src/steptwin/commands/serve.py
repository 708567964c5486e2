"""`steptwin serve`: make a world from options and run it as `steptwin up` does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from steptwin.commands.chips import Chain, check_chain, parse_addresses, parse_wire, placed_wires
from steptwin.commands.descriptions import Describe, Named, print_world, save_world
from steptwin.commands.up_world import UpOptions, up_with
from steptwin.durations import duration_text
from steptwin.errors import Misuse
from steptwin.files.programbanks import parse_banks
from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.live.serving import check_line_timing, check_name
from steptwin.live.transports import TRANSPORTS
from steptwin.m1486.lines import interface
from steptwin.m1486.pins import baud_pins
from steptwin.m1486.variants import DEFAULT, variant
from steptwin.machine import MILLISECOND, Nanos
from steptwin.mic488.config import BAUDS
from steptwin.mic488.registers import firmware as known_firmware
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.world.addresses import check_addresses
from steptwin.world.description import read_world
from steptwin.world.faults import read as read_fault
from steptwin.world.small import Whole, m1486_world, mic488_world

MOST_GAP_MS = 10_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions:
    """The options common to both controllers; see ``steptwin serve mic488 --help``."""

    name: str
    links: Mapping[str, str | None] = field(default_factory=dict)
    """Where it is reached, by keys of ``[[line]]``."""
    baud: int | None = None
    state: Path | None = None
    trace: str | None = None
    line_timing: str = "off"
    ready_file: Path | None = None
    log_frames: bool = False
    listen_any: bool = False
    faults: tuple[str, ...] = ()
    seed: int = 0
    print_world: bool = False
    save_world: Path | None = None

    def whole(self, **line: object) -> Whole:
        timing = None if self.line_timing == "off" else self.line_timing
        return Whole(
            name=self.name,
            line={**self.links, "baud": self.baud, **line, "timing": timing},
            seed=self.seed,
            state=None if self.state is None else str(self.state),
            trace=self.trace,
            faults=[read_fault(fault) for fault in self.faults],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeMic488(ServeOptions):
    """The command's options as given; see ``steptwin serve mic488 --help``."""

    name: str = "mic488"
    firmware: str = "1.70"
    units: str | None = None
    config: Path | None = None
    programs: tuple[str, ...] = ()
    positions: tuple[str, ...] = ()
    vision: str | None = None
    statement_time: Nanos = STATEMENT_TIME
    lenient: bool = False
    gap_ms: float | None = None
    demo: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeM1486(ServeOptions):
    """The command's options as given; see ``steptwin serve m1486 --help``."""

    name: str = "m1486"
    variant: str = DEFAULT.name
    chain: str = "F"
    interface: str = "sd"
    wires: tuple[str, ...] = ()
    program: Path | None = None


def serve_mic488(options: ServeMic488) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    _check_addresses(options, options.vision)
    _serve(options, partial(describe_mic488, options), describe_mic488(replace(options, faults=())))


def serve_m1486(options: ServeM1486) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    _check_addresses(options)
    _serve(options, partial(describe_m1486, options), describe_m1486(replace(options, faults=())))


def _check_addresses(options: ServeOptions, *others: str | None) -> None:
    links = (options.links.get(key) for key, transport in TRANSPORTS.items() if transport.is_address)
    check_addresses((*links, *others), listen_any=options.listen_any)


def _serve(options: ServeOptions, describe: Describe, text: str) -> None:
    """Run the description ``text``. Faults are not part of it; they are set as `up` sets those of its command line."""
    check_name(options.name)
    name = f"serve {options.name}"
    if options.print_world:
        print_world(describe(str), name)
        return
    if options.save_world is not None:
        save_world(describe, options.save_world)
        return
    spec = read_world(name, text)
    files = {file: read_bytes(Path(file)) for file, _ in spec.files()}
    with World.from_toml(text, files, name=name, keep_inputs=False, state=options.state) as world:
        up_with(
            world,
            UpOptions(
                world=None,
                name=options.name,
                faults=options.faults,
                trace=options.trace,
                ready_file=options.ready_file,
                log_frames=options.log_frames,
                listen_any=options.listen_any,
            ),
        )


# ---------------------------------------------------------------------- descriptions


def describe_mic488(options: ServeMic488, named: Named = str) -> str:
    """The description of the world to serve. Raises `Misuse` for invalid options."""
    check_line_timing(options.line_timing, "real", "strict")
    if options.baud is not None and options.baud not in BAUDS:
        raise Misuse(f"--baud {options.baud}: permitted are {', '.join(map(str, BAUDS))} bit/s")
    if options.demo and options.config is not None:
        raise Misuse(f"--demo and --config {options.config}: the demo has a configuration of its own; give one of the two")
    if options.gap_ms is not None and not 0.0 < options.gap_ms <= MOST_GAP_MS:
        raise Misuse(f"--gap {options.gap_ms:g}: permitted are more than 0 and at most {MOST_GAP_MS:g} ms")
    units: list[int] | list[None] = [None] if options.units is None else parse_units(options.units)
    if options.vision is not None and len(units) > 1:
        raise Misuse("--vision is for a single unit: a vision system belongs to one controller")
    banks = known_firmware(options.firmware).banks
    programs = parse_banks("--program", options.programs, banks)
    positions = parse_banks("--positions", options.positions, banks)
    gap = None if options.gap_ms is None else duration_text(round(options.gap_ms * MILLISECOND))
    values = {
        "firmware": options.firmware,
        "config": None if options.config is None else named(options.config),
        "programs": {bank: named(file) for bank, file in programs.items()} or None,
        "positions": {bank: named(file) for bank, file in positions.items()} or None,
        "statement_time": None if options.statement_time == STATEMENT_TIME else duration_text(options.statement_time),
        "lenient": options.lenient or None,
        "vision": options.vision,
    }
    return mic488_world(options.whole(gap=gap), units, values, demo=options.demo)


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


def parse_units(text: str) -> list[int]:
    """``1,2,5`` → slave addresses. Raises `Misuse`."""
    units: list[int] = []
    for part in text.split(","):
        if not part.strip().isdecimal() or not 1 <= int(part) <= 247:
            raise Misuse(f"--units {text}: {part.strip()!r} is not a slave address; permitted are 1 to 247, separated by commas")
        if int(part) in units:
            raise Misuse(f"--units {text}: {int(part)} is given twice")
        units.append(int(part))
    return units

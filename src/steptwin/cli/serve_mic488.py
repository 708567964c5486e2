"""`steptwin serve mic488`: MIC488 controllers made from options."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from steptwin.cli.serving import ServeOptions, check_links, serve
from steptwin.durations import duration_text
from steptwin.errors import Misuse
from steptwin.files.programbanks import parse_banks
from steptwin.languages.descriptions import Named
from steptwin.live.serving import check_line_timing
from steptwin.machine import MILLISECOND, Nanos
from steptwin.mic488.config import BAUDS
from steptwin.mic488.registers import firmware as known_firmware
from steptwin.numerals import read_whole
from steptwin.simulation.describe.small_mic488 import mic488_world
from steptwin.wbc.interpreter import STATEMENT_TIME

MOST_GAP_MS = 10_000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeMic488:
    """The controllers, as given; see ``steptwin serve mic488 --help``."""

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


def serve_mic488(twin: ServeOptions, controllers: ServeMic488) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    check_links(twin, controllers.vision)
    serve(twin, partial(describe_mic488, twin, controllers), describe_mic488(replace(twin, faults=()), controllers))


def describe_mic488(twin: ServeOptions, controllers: ServeMic488, named: Named = str) -> str:
    """The description of the world to serve. Raises `Misuse` for invalid options."""
    check_line_timing(twin.line_timing, "real", "strict")
    if twin.baud is not None and twin.baud not in BAUDS:
        raise Misuse(f"--baud {twin.baud}: permitted are {', '.join(map(str, BAUDS))} bit/s")
    if controllers.demo and controllers.config is not None:
        raise Misuse(f"--demo and --config {controllers.config}: the demo has a configuration of its own; give one of the two")
    if controllers.gap_ms is not None and not 0.0 < controllers.gap_ms <= MOST_GAP_MS:
        raise Misuse(f"--gap {controllers.gap_ms:g}: permitted are more than 0 and at most {MOST_GAP_MS:g} ms")
    units: list[int] | list[None] = [None] if controllers.units is None else parse_units(controllers.units)
    if controllers.vision is not None and len(units) > 1:
        raise Misuse("--vision is for a single unit: a vision system belongs to one controller")
    banks = known_firmware(controllers.firmware).banks
    programs = parse_banks("--program", controllers.programs, banks)
    positions = parse_banks("--positions", controllers.positions, banks)
    gap = None if controllers.gap_ms is None else duration_text(round(controllers.gap_ms * MILLISECOND))
    values = {
        "firmware": controllers.firmware,
        "config": None if controllers.config is None else named(controllers.config),
        "programs": {bank: named(file) for bank, file in programs.items()} or None,
        "positions": {bank: named(file) for bank, file in positions.items()} or None,
        "statement_time": None if controllers.statement_time == STATEMENT_TIME else duration_text(controllers.statement_time),
        "lenient": controllers.lenient or None,
        "vision": controllers.vision,
    }
    return mic488_world(twin.whole(gap=gap), units, values, demo=controllers.demo)


def parse_units(text: str) -> list[int]:
    """``1,2,5`` → slave addresses. Raises `Misuse`."""
    units: list[int] = []
    for part in text.split(","):
        unit = read_whole(part.strip())
        if unit is None or not 1 <= unit <= 247:
            raise Misuse(f"--units {text}: {part.strip()!r} is not a slave address; permitted are 1 to 247, separated by commas")
        if unit in units:
            raise Misuse(f"--units {text}: {unit} is given twice")
        units.append(unit)
    return units

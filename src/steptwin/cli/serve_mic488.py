"""``steptwin serve mic488``: MIC488 controllers made from options."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from steptwin.cli.optiongroups import grouped
from steptwin.cli.serving import LineOptions, Served, TwinOptions, serve
from steptwin.errors import Misuse
from steptwin.live.options import LiveOptions, LogOptions
from steptwin.numerals import read_whole
from steptwin.options import Option, OptionGroup

if TYPE_CHECKING:
    from steptwin.languages.descriptions import Named

PORTS = {"tcp": 5020, "rtu_tcp": 5021}
MOST_GAP_MS = 10_000.0


@dataclass(frozen=True, kw_only=True)
class ModbusOptions(LineOptions):
    tcp: Annotated[str | None, Option("Modbus TCP; port 0 takes a free one.", metavar="HOST:PORT")] = None
    rtu_tcp: Annotated[str | None, Option("RTU frames over TCP.", metavar="HOST:PORT")] = None
    tls_tcp: Annotated[
        str | None, Option("Modbus TCP Security, such as 127.0.0.1:8802; with the next three.", metavar="HOST:PORT")
    ] = None
    certificate: Annotated[Path | None, Option("Certificate of the twin (PEM).")] = None
    key: Annotated[Path | None, Option("Its key (PEM).")] = None
    trusted: Annotated[Path | None, Option("Certificates of clients, or of those who sign them (.pem).", metavar="FOLDER")] = None
    baud: Annotated[int | None, Option("Baud rate. Default: that of the configuration, or 38400.")] = None
    line_timing: Annotated[
        str,
        Option(
            "'real': requests take the time of the wire and of the controller; 'strict': and a pause above 0.75 ms inside "
            "a frame drops the whole burst; 'off'."
        ),
    ] = "off"
    gap: Annotated[
        float | None,
        Option(
            "Silence in ms that ends a burst: shorten it if requests after noise are lost. "
            "It does not split frames, which may pause for 2 s. Default: 0.75 on a serial port, else 20."
        ),
    ] = None

    @property
    def links(self) -> dict[str, str | None]:
        return {**super().links, "rtu_tcp": self.rtu_tcp, "tls_tcp": self.tls_tcp}

    @property
    def tls(self) -> dict[str, str | None]:
        files = {"certificate": self.certificate, "key": self.key, "trusted": self.trusted}
        if len({self.tls_tcp is None, *(file is None for file in files.values())}) > 1:
            raise Misuse("--tls-tcp, --certificate, --key and --trusted are given together")
        return {name: None if file is None else str(file.absolute()) for name, file in files.items()}


@dataclass(frozen=True, kw_only=True)
class Mic488Options(OptionGroup):
    """The controllers."""

    heading = "Options of the controllers"

    firmware: Annotated[str, Option("Register map: 1.23, 1.40 or 1.70.", completion="firmwares")] = "1.70"
    units: Annotated[str | None, Option("Slave addresses, such as 1,2,5. Default: that of the configuration, or 1.")] = None
    config: Annotated[Path | None, Option("The vendor tool's .cfg file.")] = None
    program: Annotated[
        tuple[str, ...], Option("WBC program (.prg) for a bank: BANK=FILE; repeatable. FILE alone is for bank 0.")
    ] = ()
    positions: Annotated[tuple[str, ...], Option("Position table (.csv) for a bank: BANK=FILE; repeatable.")] = ()
    vision: Annotated[
        str | None, Option("Records of a vision system ('N1 X12.5 Y-3 A90' and a line end).", metavar="HOST:PORT")
    ] = None
    statement_time: Annotated[str, Option("What one statement of a program takes; 0 for none.", metavar="TIME")] = "1ms"
    lenient: Annotated[bool, Option("Holes of the register map read as 0 instead of being refused.")] = False
    demo: Annotated[bool, Option("Four spindles in mm with a switch at each end.")] = False


@grouped
def mic488(*, controllers: Mic488Options, line: ModbusOptions, twin: TwinOptions, live: LiveOptions, log: LogOptions) -> None:
    """Serve virtual MIC488 controllers.

    Without any of --pty, --serial, --tcp, --rtu-tcp, --rfc2217 and --tls-tcp it listens on a pty (where the
    system has them), on 127.0.0.1:5020 (Modbus TCP) and on
    127.0.0.1:5021 (RTU over TCP); with --listen-any on all interfaces.
    """
    serve_mic488(Served(kind="mic488", line=line, ports=PORTS, twin=twin, live=live, log=log), controllers)


def serve_mic488(served: Served, controllers: Mic488Options) -> None:
    served.check_links(controllers.vision)
    serve(served, lambda served, named: describe_mic488(served, controllers, named))


def describe_mic488(served: Served, controllers: Mic488Options, named: Named = str) -> str:
    """The description of the world to serve. Raises `Misuse` for invalid options."""
    from steptwin.controller import MILLISECOND
    from steptwin.durations import duration_text
    from steptwin.files.programbanks import parse_banks
    from steptwin.files.timedinputs import parse_duration
    from steptwin.live.serving import check_line_timing
    from steptwin.mic488.config import BAUDS
    from steptwin.mic488.registers import firmware as known_firmware
    from steptwin.simulation.describe.generated_mic488 import mic488_world
    from steptwin.wbc.interpreter import STATEMENT_TIME

    line = served.line
    statement_time = parse_duration(controllers.statement_time, "--statement-time")
    check_line_timing(line.line_timing, "real", "strict")
    if line.baud is not None and line.baud not in BAUDS:
        raise Misuse(f"--baud {line.baud}: permitted are {', '.join(map(str, BAUDS))} bit/s")
    if controllers.demo and controllers.config is not None:
        raise Misuse(f"--demo and --config {controllers.config}: the demo has a configuration of its own; give one of the two")
    if line.gap is not None and not 0.0 < line.gap <= MOST_GAP_MS:
        raise Misuse(f"--gap {line.gap:g}: permitted are more than 0 and at most {MOST_GAP_MS:g} ms")
    units: list[int] | list[None] = [None] if controllers.units is None else parse_units(controllers.units)
    if controllers.vision is not None and len(units) > 1:
        raise Misuse("--vision is for a single unit: a vision system belongs to one controller")
    banks = known_firmware(controllers.firmware).banks
    programs = parse_banks("--program", controllers.program, banks)
    positions = parse_banks("--positions", controllers.positions, banks)
    values = {
        "firmware": controllers.firmware,
        "config": None if controllers.config is None else named(controllers.config),
        "programs": {bank: named(file) for bank, file in programs.items()} or None,
        "positions": {bank: named(file) for bank, file in positions.items()} or None,
        "statement_time": None if statement_time == STATEMENT_TIME else duration_text(statement_time),
        "lenient": controllers.lenient or None,
        "vision": controllers.vision,
    }
    gap = None if line.gap is None else duration_text(round(line.gap * MILLISECOND))
    return mic488_world(served.whole(gap=gap), units, values, demo=controllers.demo)


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

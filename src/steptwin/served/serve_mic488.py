"""`steptwin serve mic488` behind its options."""

from __future__ import annotations

import asyncio
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from steptwin.diagnostics import Severity, render
from steptwin.errors import Misuse
from steptwin.files.programbanks import Banks, Findings, ProgramErrors, parse_banks, read_banks
from steptwin.inputfiles import read_bytes
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.live.lines import Face, Lines
from steptwin.live.output import Output
from steptwin.live.rfc2217 import TwinLine, over_network
from steptwin.live.server import Server, clear_ready_file
from steptwin.live.serving import check_line_timing, check_name, shows_live_view
from steptwin.machine import MILLISECOND, Nanos
from steptwin.mic488.config import BAUDS, ConfigError, ControllerConfig, examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.mic488.registers import firmware as known_firmware
from steptwin.served.demo import demo_config
from steptwin.served.mic488 import LineOptions, Mic488Line, open_state
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.machine import STATEMENT_TIME
from steptwin.wire.rtu import BURSTY_GAP_NS, UART_GAP_NS
from steptwin.world.addresses import check_addresses, parse_address
from steptwin.world.faults import Line

RTU = "Modbus RTU"
TCP = "Modbus TCP"
RTU_TCP = "RTU over TCP"
RFC2217 = "network port"
VISION = "vision records"


@dataclass(frozen=True, slots=True, kw_only=True)
class Mic488Options:
    """The command's options as given; see ``steptwin serve mic488 --help``."""

    firmware: str = "1.70"
    units: str | None = None
    pty: Path | None = None
    serial: str | None = None
    baud: int | None = None
    tcp: str | None = None
    rtu_tcp: str | None = None
    rfc2217: str | None = None
    config: Path | None = None
    programs: tuple[str, ...] = ()
    positions: tuple[str, ...] = ()
    vision: str | None = None
    statement_time: Nanos = STATEMENT_TIME
    state: Path | None = None
    lenient: bool = False
    line_timing: str = "off"
    gap_ms: float | None = None
    ready_file: Path | None = None
    log_frames: bool = False
    name: str = "mic488"
    listen_any: bool = False
    demo: bool = False
    faults: tuple[str, ...] = ()
    seed: int = 0


def serve(options: Mic488Options) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    check_line_timing(options.line_timing, "real", "strict")
    if options.baud is not None and options.baud not in BAUDS:
        raise Misuse(f"--baud {options.baud}: permitted are {', '.join(map(str, BAUDS))} bit/s")
    if options.demo and options.config is not None:
        raise Misuse(f"--demo and --config {options.config}: the demo has a configuration of its own; give one of the two")
    if options.gap_ms is not None and not 0.0 < options.gap_ms <= 10_000.0:
        raise Misuse(f"--gap {options.gap_ms:g}: permitted are more than 0 and at most 10000 ms")
    check_name(options.name)
    known_firmware(options.firmware)
    check_addresses((options.tcp, options.rtu_tcp, options.rfc2217, options.vision), listen_any=options.listen_any)
    if options.config is not None:
        config = load_config(options.config, options.firmware)
    else:
        config = demo_config() if options.demo else ControllerConfig()
    units = parse_units(options.units) if options.units is not None else [config.address]
    if options.vision is not None and len(units) > 1:
        raise Misuse("--vision is for a single unit: a vision system belongs to one controller")
    banks = _load_banks(options, config)
    if options.ready_file is not None:
        clear_ready_file(options.ready_file)
    asyncio.run(_serve(options, config, units, banks))


def load_config(path: Path, firmware: str) -> ControllerConfig:
    """The configuration in a ``.cfg`` file. Raises `Misuse` for a file that cannot be read, and with every error in it.

    Warnings go to standard error.
    """
    file = IniFile.parse(read_bytes(path), str(path))
    config, findings = examine_config(file, firmware)
    if any(finding.severity is Severity.ERROR for finding in findings):
        raise ConfigError(file.source, findings)
    _show(((file.source, findings),))
    return config


def parse_units(text: str) -> list[int]:
    """``1,2,5`` → slave addresses. Raises `Misuse`."""
    units: list[int] = []
    for part in text.split(","):
        if not part.strip().isdecimal() or not 1 <= int(part) <= 247:
            raise Misuse(f"--units {text}: {part.strip()!r} is no slave address; permitted are 1 to 247, separated by commas")
        if int(part) in units:
            raise Misuse(f"--units {text}: {int(part)} is given twice")
        units.append(int(part))
    return units


def _load_banks(options: Mic488Options, config: ControllerConfig) -> Banks:
    """What ``--program`` and ``--positions`` name. Findings go to standard error as `check` prints them."""
    if not options.programs and not options.positions:
        return Banks()
    number = known_firmware(options.firmware).banks
    programs = parse_banks("--program", options.programs, number)
    positions = parse_banks("--positions", options.positions, number)
    try:
        banks = read_banks(programs, positions, config, dialect_for(options.firmware))
    except ProgramErrors as errors:
        _show(errors.findings)
        raise
    _show(banks.findings)
    return banks


def _show(findings: Findings) -> None:
    for source, diagnostics in findings:
        if diagnostics:
            sys.stderr.write(render(source, diagnostics) + "\n")


async def _serve(options: Mic488Options, config: ControllerConfig, units: list[int], banks: Banks) -> None:
    with ExitStack() as stack:
        output = Output(sys.stdout)
        stack.callback(output.close)
        live = shows_live_view(output, log_frames=options.log_frames)
        baud = options.baud or config.ports[0].baud
        line = Mic488Line(
            config,
            units,
            options.firmware,
            banks,
            lenient=options.lenient,
            statement_time=options.statement_time,
            state=open_state(stack, options.state),
            demo=options.demo,
            options=LineOptions(
                baud=baud,
                timing=options.line_timing != "off",
                strict=options.line_timing == "strict",
                frames=live or options.log_frames,
            ),
        )
        cell = Cell(line.kernel, Clock())
        line.share_reads(cell)
        face = _live_view(line, cell, output) if live else Lines(line, output, frames=options.log_frames)
        server = Server(cell, face.notice)
        line.faults.tell(face.notice)
        try:
            await _open(server, line, options, baud)
            await face.show(server, remarks(options, config, banks))
        finally:
            await server.close()


def _live_view(line: Mic488Line, cell: Cell, output: Output) -> Face:
    from steptwin.served.view import Mic488View

    return Mic488View(line, cell, output)


async def _open(server: Server, line: Mic488Line, options: Mic488Options, baud: int) -> None:
    line.faults.lines = _lines(options)
    line.faults.start(options.faults, options.seed)
    gap: Nanos | None = None if options.gap_ms is None else round(options.gap_ms * MILLISECOND)
    bursty = BURSTY_GAP_NS if gap is None else gap
    # First: it finds another server of this name, and with it the pty of that name.
    await server.open_control(options.name, line.handlers(server.cell))
    if options.pty is not None:
        await server.open_pty(options.pty, RTU, lambda: line.rtu_port("pty", bursty))
    if options.serial is not None:
        uart = UART_GAP_NS if gap is None else gap
        await server.open_serial(options.serial, baud, RTU, lambda: line.rtu_port("serial", uart, baud=baud))
    if options.tcp is not None:
        await server.open_tcp("tcp", parse_address(options.tcp, listen_any=options.listen_any), TCP, line.tcp_port)
    if options.rtu_tcp is not None:
        address = parse_address(options.rtu_tcp, listen_any=options.listen_any)
        await server.open_tcp("rtu-tcp", address, RTU_TCP, lambda: line.rtu_client_port(bursty))
    if options.rfc2217 is not None:
        address = parse_address(options.rfc2217, listen_any=options.listen_any)
        wire = TwinLine(lambda: baud, line.options.timing, server.notice)
        await server.open_tcp("rfc2217", address, RFC2217, lambda: over_network(line.rtu_client_port(bursty), wire))
    if options.vision is not None:
        address = parse_address(options.vision, listen_any=options.listen_any)
        await server.open_tcp("vision", address, VISION, line.vision_port)
    if options.ready_file is not None:
        server.write_ready_file(options.ready_file, options.name)


def _lines(options: Mic488Options) -> set[Line]:
    serial = {Line.RTU} if options.pty or options.serial or options.rtu_tcp or options.rfc2217 else set()
    return serial | {Line.TCP} if options.tcp else serial


def _empty_banks(config: ControllerConfig, banks: Banks) -> list[str]:
    """A configuration that starts a program nobody gave lights ERR at power-on, as on the device: why, and what to do."""
    bank, table = config.program.prog_bank, config.program.pos_bank
    if not config.program.activate:
        return []
    begin = f"ERR is on: Activate=1 starts program bank {bank} at power-on"
    program = banks.programs.get(bank)
    if program is None:
        return [f"{begin}, which is empty (--program {bank}=FILE)"]
    if program.uses_positions and table not in banks.positions:
        return [f"{begin} with position bank {table}, which is empty (--positions {table}=FILE)"]
    return []


def remarks(options: Mic488Options, config: ControllerConfig, banks: Banks) -> list[str]:
    """Remarks for the person who started this."""
    remarks = _empty_banks(config, banks)
    if options.listen_any:
        remarks.append("Modbus has no authentication: whoever reaches these addresses moves the axes")
    if options.state is None and known_firmware(options.firmware).stored_user_registers:
        remarks.append("non-volatile memory ends with this process (--state DIR keeps it)")
    return remarks

"""`steptwin serve m1486` behind its options."""

from __future__ import annotations

import asyncio
import sys
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from steptwin.diagnostics import Severity, render
from steptwin.errors import Misuse
from steptwin.files.memory import StateDirectory
from steptwin.files.textfiles import read_text
from steptwin.live.cell import Cell
from steptwin.live.clock import Clock
from steptwin.live.lines import Face, Lines
from steptwin.live.output import Output
from steptwin.live.rfc2217 import TwinLine, over_network
from steptwin.live.server import Server, clear_ready_file
from steptwin.live.serving import check_line_timing, check_name, shows_live_view
from steptwin.m1486.check import check
from steptwin.m1486.chip import baud_pins
from steptwin.m1486.eeprom import image_of
from steptwin.m1486.lines import interface
from steptwin.m1486.variants import DEFAULT, Store, variant
from steptwin.served.m1486 import ChainOptions, M1486Line, parse_addresses, parse_wire
from steptwin.world.addresses import check_addresses, parse_address

CHARACTERS = "M1486 line"


@dataclass(frozen=True, slots=True, kw_only=True)
class M1486Options:
    """The command's options as given; see ``steptwin serve m1486 --help``."""

    variant: str = DEFAULT.name
    chain: str = "F"
    interface: str = "sd"
    wires: tuple[str, ...] = ()
    pty: Path | None = None
    serial: str | None = None
    baud: int | None = None
    tcp: str | None = None
    rfc2217: str | None = None
    state: Path | None = None
    program: Path | None = None
    line_timing: str = "off"
    ready_file: Path | None = None
    log_frames: bool = False
    name: str = "m1486"
    listen_any: bool = False
    faults: tuple[str, ...] = ()
    seed: int = 0


def serve(options: M1486Options) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP. Raises `Misuse` or another `SteptwinError` with a text for the user."""
    check_line_timing(options.line_timing, "real")
    check_name(options.name)
    kind = variant(options.variant)
    baud_pins(kind, options.baud)
    check_addresses((options.tcp, options.rfc2217), listen_any=options.listen_any)
    chain = ChainOptions(
        variant=kind,
        addresses=parse_addresses(options.chain),
        interface=interface(options.interface),
        baud=options.baud,
        is_timed=options.line_timing == "real",
        wires=[parse_wire(wire) for wire in options.wires],
    )
    image = None if options.program is None else program_image(options.program, chain)
    if options.ready_file is not None:
        clear_ready_file(options.ready_file)
    asyncio.run(_serve(options, chain, image))


def program_image(path: Path, chain: ChainOptions) -> bytes:
    """The program in a file as the chip stores it. Raises `Misuse` with every error in it."""
    source = read_text(path).source
    checked = check(source.text, chain.variant, chain.interface)
    if not checked.is_sound:
        errors = [d for d in checked.diagnostics if d.severity is Severity.ERROR]
        raise Misuse(f"{path} is no program to switch on with:\n{render(source, errors)}")
    try:
        return image_of(checked.program, chain.variant)
    except Misuse as misuse:
        raise Misuse(f"{path}: {misuse}") from None


async def _serve(options: M1486Options, chain: ChainOptions, image: bytes | None) -> None:
    with ExitStack() as stack:
        output = Output(sys.stdout)
        stack.callback(output.close)
        live = shows_live_view(output, log_frames=options.log_frames)
        chain = replace(chain, is_written_down=live or options.log_frames)
        state = None if options.state is None else stack.enter_context(StateDirectory(options.state))
        line = M1486Line(chain, state=state, image=image)
        cell = Cell(line.kernel, Clock())
        face = _live_view(line, cell, output) if live else Lines(line, output, frames=options.log_frames)
        server = Server(cell, face.notice)
        line.faults.tell(face.notice)
        listener = line.log_characters(cell) if chain.is_written_down else None
        try:
            await _open(server, line, options)
            await face.show(server, remarks_of(options))
        finally:
            if listener is not None:
                listener.close()
            await server.close()


def _live_view(line: M1486Line, cell: Cell, output: Output) -> Face:
    from steptwin.served.m1486_view import M1486View

    return M1486View(line, cell, output)


async def _open(server: Server, line: M1486Line, options: M1486Options) -> None:
    line.faults.start(options.faults, options.seed)
    # First, for it tells who else has this name, and with it the pty of that name.
    await server.open_control(options.name, line.handlers(server.cell))
    if options.pty is not None:
        await server.open_pty(options.pty, CHARACTERS, lambda: line.port("pty"))
    if options.serial is not None:
        await server.open_serial(options.serial, line.baud, CHARACTERS, lambda: line.port("serial"))
    if options.tcp is not None:
        await server.open_tcp("tcp", parse_address(options.tcp, listen_any=options.listen_any), CHARACTERS, line.client_port)
    if options.rfc2217 is not None:
        address = parse_address(options.rfc2217, listen_any=options.listen_any)
        wire = TwinLine(line.present_baud, options.line_timing == "real", server.notice)
        await server.open_tcp("rfc2217", address, CHARACTERS, lambda: over_network(line.client_port(), wire))
    if options.ready_file is not None:
        server.write_ready_file(options.ready_file, options.name)


def remarks_of(options: M1486Options) -> list[str]:
    """What the person who started this should know."""
    kind = variant(options.variant)
    remarks = []
    if options.listen_any:
        remarks.append("the line has no authentication: whoever reaches these addresses moves the motors")
    if kind.store is Store.RAM:
        if options.state is not None:
            remarks.append(f"{kind.title} keeps its program in RAM: nothing goes into {options.state}")
    elif options.state is None:
        remarks.append("the EEPROM ends with this process (--state DIR keeps it)")
    return remarks

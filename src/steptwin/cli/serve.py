"""``steptwin serve``: serve twins made from options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from steptwin.cli import completion

app = typer.Typer(help="Serve a twin until Ctrl-C.", no_args_is_help=True)

MODBUS_TCP_PORT = 5020
RTU_TCP_PORT = 5021
M1486_TCP_PORT = 5022

ListenAny = Annotated[
    bool,
    typer.Option(
        "--listen-any", help="Permit addresses that other computers can reach; without any address, listen on all interfaces."
    ),
]

Fault = Annotated[
    list[str] | None,
    typer.Option(help="Fault active from the start, such as 'crc nth=3'; repeatable. See steptwin fault --kinds."),
]
Seed = Annotated[int, typer.Option(help="Random seed for faults.")]

Trace = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="Write a trace to a file; 'ring N' keeps the last N records for 'save'; 'off' keeps none."),
]
PrintWorld = Annotated[
    bool, typer.Option("--print-world", help="Print the description of this twin as a world, for 'up', and end.")
]
SaveWorld = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write that description to FILE, with the files it names beside it, and end.")
]


Firmware = Annotated[str, typer.Option(help="Register map: 1.23, 1.40 or 1.70.", autocompletion=completion.firmwares)]
Units = Annotated[str | None, typer.Option(help="Slave addresses, such as 1,2,5. Default: that of the configuration, or 1.")]
Rfc2217 = Annotated[str | None, typer.Option(metavar="HOST:PORT", help="A network serial port (RFC 2217) with Modbus RTU.")]
Program = Annotated[
    list[str] | None, typer.Option(help="WBC program (.prg) for a bank: BANK=FILE; repeatable. FILE alone is for bank 0.")
]
Vision = Annotated[
    str | None, typer.Option(metavar="HOST:PORT", help="Records of a vision system ('N1 X12.5 Y-3 A90' and a line end).")
]
StatementTime = Annotated[str, typer.Option(metavar="TIME", help="What one statement of a program takes; 0 for none.")]
State = Annotated[Path | None, typer.Option(help="Directory of the non-volatile memory. Without it, memory ends with the twin.")]
Lenient = Annotated[bool, typer.Option("--lenient", help="Holes of the register map read as 0 instead of being refused.")]
LineTiming = Annotated[
    str,
    typer.Option(
        help="'real': requests take the time of the wire and of the controller; 'strict': and a pause above 0.75 ms inside a "
        "frame drops it; 'off'."
    ),
]
Gap = Annotated[
    float | None,
    typer.Option(
        help="Silence in ms after which bytes outside a frame are discarded: shorten it if requests after noise are lost. "
        "It does not split frames, which may pause for 2 s. Default: 0.75 on a serial port, else 20."
    ),
]
ReadyFile = Annotated[Path | None, typer.Option(help="JSON file with the end points, written when all of them are open.")]
LogFrames = Annotated[bool, typer.Option("--log-frames", help="Print every frame with time, direction, bytes and meaning.")]
ChipVariant = Annotated[
    str, typer.Option(help="Type: A, B, C, E1, E2, or A2x and so on (24 MHz).", autocompletion=completion.variants)
]
ChipWire = Annotated[
    list[str] | None, typer.Option(help="Wire from a pin of one chip to an input of another: 0.B1=7.B3; repeatable.")
]
ChipRfc2217 = Annotated[str | None, typer.Option(metavar="HOST:PORT", help="The line as a network serial port (RFC 2217).")]
ChipState = Annotated[
    Path | None,
    typer.Option(help="Directory that keeps the EEPROMs of E types. Without it their contents are lost when the twin ends."),
]
ChipReadyFile = Annotated[Path | None, typer.Option(help="JSON file with the end points, written when all of them are open.")]
ChipLogFrames = Annotated[
    bool, typer.Option("--log-frames", help="Print everything on the line with time, direction, bytes and meaning.")
]


def _default_host(listen_any: bool) -> str:
    return "0.0.0.0" if listen_any else "127.0.0.1"


def _default_pty(name: str) -> str | None:
    from steptwin.live.directory import runtime_directory
    from steptwin.system import HAS_PTYS

    return str(runtime_directory() / name) if HAS_PTYS else None


def _text(path: Path | None) -> str | None:
    return None if path is None else str(path)


@app.command()
def mic488(
    firmware: Firmware = "1.70",
    units: Units = None,
    pty: Annotated[Path | None, typer.Option(help="Modbus RTU on a pseudo terminal, with PATH as a link to it.")] = None,
    serial: Annotated[str | None, typer.Option(help="Modbus RTU on a real serial port, 8N1.")] = None,
    baud: Annotated[int | None, typer.Option(help="Baud rate. Default: that of the configuration, or 38400.")] = None,
    tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="Modbus TCP; port 0 takes a free one.")] = None,
    rtu_tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="RTU frames over TCP.")] = None,
    rfc2217: Rfc2217 = None,
    config: Annotated[Path | None, typer.Option(help="The vendor tool's .cfg file.")] = None,
    program: Program = None,
    positions: Annotated[list[str] | None, typer.Option(help="Position table (.csv) for a bank: BANK=FILE; repeatable.")] = None,
    vision: Vision = None,
    statement_time: StatementTime = "1ms",
    state: State = None,
    lenient: Lenient = False,
    trace: Trace = None,
    line_timing: LineTiming = "off",
    gap: Gap = None,
    ready_file: ReadyFile = None,
    log_frames: LogFrames = False,
    name: Annotated[str, typer.Option(help="Name under which 'steptwin pin' and its like find this twin.")] = "mic488",
    listen_any: ListenAny = False,
    fault: Fault = None,
    seed: Seed = 0,
    print_world: PrintWorld = False,
    save_world: SaveWorld = None,
    demo: Annotated[bool, typer.Option("--demo", help="Four spindles in mm with a switch at each end.")] = False,
) -> None:
    """Serve virtual MIC488 controllers.

    Without any of --pty, --serial, --tcp, --rtu-tcp and --rfc2217 it listens on a pty (where the
    system has them), on 127.0.0.1:5020 (Modbus TCP) and on
    127.0.0.1:5021 (RTU over TCP).
    """
    from steptwin.commands.serve_mic488 import ServeMic488, serve_mic488
    from steptwin.files.timedinputs import parse_duration

    links = {"pty": _text(pty), "serial": serial, "tcp": tcp, "rtu_tcp": rtu_tcp, "rfc2217": rfc2217}
    if not any(links.values()):
        host = _default_host(listen_any)
        links = {"pty": _default_pty(name), "tcp": f"{host}:{MODBUS_TCP_PORT}", "rtu_tcp": f"{host}:{RTU_TCP_PORT}"}
    serve_mic488(
        ServeMic488(
            firmware=firmware,
            units=units,
            links=links,
            baud=baud,
            config=config,
            programs=tuple(program or ()),
            positions=tuple(positions or ()),
            vision=vision,
            statement_time=parse_duration(statement_time, "--statement-time"),
            state=state,
            trace=trace,
            lenient=lenient,
            line_timing=line_timing,
            gap_ms=gap,
            ready_file=ready_file,
            log_frames=log_frames,
            name=name,
            listen_any=listen_any,
            faults=tuple(fault or ()),
            seed=seed,
            print_world=print_world,
            save_world=save_world,
            demo=demo,
        )
    )


@app.command()
def m1486(
    variant: ChipVariant = "A",
    chain: Annotated[str, typer.Option(help="Addresses of the chips on the line, such as 0,7; hexadecimal digits.")] = "F",
    interface: Annotated[str, typer.Option(help="Driver interface: sd, dual or two.")] = "sd",
    wire: ChipWire = None,
    pty: Annotated[Path | None, typer.Option(help="The line on a pseudo terminal, with PATH as a link to it.")] = None,
    serial: Annotated[str | None, typer.Option(help="The line on a real serial port, 8N1.")] = None,
    baud: Annotated[int | None, typer.Option(help="Baud rate selected by the BR pins. Default: the highest of the type.")] = None,
    tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="The line as raw TCP; port 0 takes a free one.")] = None,
    rfc2217: ChipRfc2217 = None,
    state: ChipState = None,
    program: Annotated[Path | None, typer.Option(help="Program in the memory of a single chip at power-on.")] = None,
    trace: Trace = None,
    line_timing: Annotated[str, typer.Option(help="'real': characters take their time on the wire; 'off': none.")] = "off",
    ready_file: ChipReadyFile = None,
    log_frames: ChipLogFrames = False,
    name: Annotated[str, typer.Option(help="Name under which 'steptwin pin' and its like find this twin.")] = "m1486",
    listen_any: ListenAny = False,
    fault: Fault = None,
    seed: Seed = 0,
    print_world: PrintWorld = False,
    save_world: SaveWorld = None,
) -> None:
    """Serve virtual M1486 chips on one line; several clients may be connected to it.

    Without any of --pty, --serial, --tcp and --rfc2217 it listens on a pty and on 127.0.0.1:5022 (raw TCP).
    """
    from steptwin.commands.serve_m1486 import ServeM1486, serve_m1486

    links = {"pty": _text(pty), "serial": serial, "tcp": tcp, "rfc2217": rfc2217}
    if not any(links.values()):
        links = {"pty": _default_pty(name), "tcp": f"{_default_host(listen_any)}:{M1486_TCP_PORT}"}
    serve_m1486(
        ServeM1486(
            variant=variant,
            chain=chain,
            interface=interface,
            wires=tuple(wire or ()),
            links=links,
            baud=baud,
            state=state,
            trace=trace,
            program=program,
            line_timing=line_timing,
            ready_file=ready_file,
            log_frames=log_frames,
            name=name,
            listen_any=listen_any,
            faults=tuple(fault or ()),
            seed=seed,
            print_world=print_world,
            save_world=save_world,
        )
    )

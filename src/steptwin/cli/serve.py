"""``steptwin serve``: serve twins made from options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from steptwin.cli import completion
from steptwin.cli.commandgroup import CommandGroup
from steptwin.cli.optiongroups import GroupedCommand, OptionGroup, grouped
from steptwin.cli.worldoptions import Control, Faults, LogOptions, LogTraffic, ReadyFile, Speed
from steptwin.cli.writtenfiles import written
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.cli.serving import ServeOptions

command = typer.Typer(
    cls=CommandGroup, add_completion=False, rich_markup_mode=None, help="Serve a twin until Ctrl-C.", no_args_is_help=True
)

MODBUS_TCP_PORT = 5020
RTU_TCP_PORT = 5021
M1486_TCP_PORT = 5022


@dataclass(frozen=True, kw_only=True)
class LineOptions(OptionGroup):
    """The line of a twin; the kinds of lines give the rest of its options their texts."""

    heading = "Options of the line"

    pty: Annotated[Path | None, typer.Option(help="The line on a pseudo terminal, with PATH as a link to it.")] = None
    serial: Annotated[str | None, typer.Option(help="The line on a real serial port, 8N1.")] = None
    rfc2217: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="The line as a network serial port (RFC 2217).")] = None
    tcp: str | None
    baud: int | None
    line_timing: str

    @property
    def links(self) -> dict[str, str | None]:
        """By keys of ``[[line]]``."""
        return {
            "pty": None if self.pty is None else str(self.pty),
            "serial": self.serial,
            "tcp": self.tcp,
            "rfc2217": self.rfc2217,
        }

    @property
    def tls(self) -> dict[str, str | None]:
        """Files of encrypted links, by keys of ``[[line]]``. Raises `Misuse`."""
        return {}


@dataclass(frozen=True, kw_only=True)
class ModbusOptions(LineOptions):
    tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="Modbus TCP; port 0 takes a free one.")] = None
    rtu_tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="RTU frames over TCP.")] = None
    tls_tcp: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Modbus TCP Security, such as 127.0.0.1:8802; with the next three.")
    ] = None
    certificate: Annotated[Path | None, typer.Option(help="Certificate of the twin (PEM).")] = None
    key: Annotated[Path | None, typer.Option(help="Its key (PEM).")] = None
    trusted: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Certificates of clients, or of those who sign them (.pem).")
    ] = None
    baud: Annotated[int | None, typer.Option(help="Baud rate. Default: that of the configuration, or 38400.")] = None
    line_timing: Annotated[
        str,
        typer.Option(
            help="'real': requests take the time of the wire and of the controller; 'strict': and a pause above 0.75 ms inside "
            "a frame drops the whole burst; 'off'."
        ),
    ] = "off"
    gap: Annotated[
        float | None,
        typer.Option(
            help="Silence in ms that ends a burst: shorten it if requests after noise are lost. "
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
class ChipLineOptions(LineOptions):
    tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="The line as raw TCP; port 0 takes a free one.")] = None
    baud: Annotated[int | None, typer.Option(help="Baud rate selected by the BR pins. Default: the highest of the type.")] = None
    line_timing: Annotated[str, typer.Option(help="'real': characters take their time on the wire; 'off': none.")] = "off"


@dataclass(frozen=True, kw_only=True)
class TwinOptions(OptionGroup):
    """Common to the twins of all controllers."""

    heading = "Options of the twin"

    name: Annotated[
        str | None, typer.Option(help="Name under which 'steptwin pin' and its like find this twin. Default: its kind.")
    ] = None
    speed: Speed = "1"
    state: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the non-volatile memory. Without it, memory ends with the twin."),
    ] = None
    trace: Annotated[
        str | None,
        written(metavar="FILE", help="Write a trace to a file; 'ring N' keeps the last N records for 'save'; 'off' keeps none."),
    ] = None
    fault: Faults = None
    seed: Annotated[int, typer.Option(help="Random seed for faults.")] = 0
    ready_file: ReadyFile = None
    control: Control = None
    log_frames: LogTraffic = False
    listen_any: Annotated[
        bool,
        typer.Option(
            "--listen-any", help="Permit addresses that other computers can reach; without any address, listen on all interfaces."
        ),
    ] = False
    print_world: Annotated[
        bool, typer.Option("--print-world", help="Print the description of this twin as a world, for 'up', and end.")
    ] = False
    save_world: Annotated[
        Path | None,
        written(metavar="FILE", help="Write that description to FILE, with the files it names beside it, and end."),
    ] = None

    def on(self, line: LineOptions, kind: str, ports: Mapping[str, int], log: LogOptions) -> ServeOptions:
        """The twin on a line; one that has no link gets those of ``ports`` and, where the system has them, a pseudo terminal."""
        from steptwin.cli.serving import ServeOptions

        name = kind if self.name is None else self.name
        return ServeOptions(
            name=name,
            links=line.links if any(line.links.values()) else {"pty": _default_pty(name), **self._listening(ports)},
            tls=line.tls,
            baud=line.baud,
            speed=self.speed,
            control=self.control,
            state=self.state,
            trace=self.trace,
            line_timing=line.line_timing,
            ready_file=self.ready_file,
            log_frames=self.log_frames,
            telling=log.telling(),
            listen_any=self.listen_any,
            faults=tuple(self.fault or ()),
            seed=self.seed,
            print_world=self.print_world,
            save_world=self.save_world,
        )

    def _listening(self, ports: Mapping[str, int]) -> dict[str, str]:
        host = "0.0.0.0" if self.listen_any else "127.0.0.1"
        return {key: f"{host}:{port}" for key, port in ports.items()}


def _default_pty(name: str) -> str | None:
    from steptwin.live.directory import runtime_directory
    from steptwin.system import HAS_PTYS

    return str(runtime_directory() / name) if HAS_PTYS else None


Firmware = Annotated[str, typer.Option(help="Register map: 1.23, 1.40 or 1.70.", autocompletion=completion.firmwares)]
Units = Annotated[str | None, typer.Option(help="Slave addresses, such as 1,2,5. Default: that of the configuration, or 1.")]
Program = Annotated[
    list[str] | None, typer.Option(help="WBC program (.prg) for a bank: BANK=FILE; repeatable. FILE alone is for bank 0.")
]
Positions = Annotated[list[str] | None, typer.Option(help="Position table (.csv) for a bank: BANK=FILE; repeatable.")]
Vision = Annotated[
    str | None, typer.Option(metavar="HOST:PORT", help="Records of a vision system ('N1 X12.5 Y-3 A90' and a line end).")
]
StatementTime = Annotated[str, typer.Option(metavar="TIME", help="What one statement of a program takes; 0 for none.")]
Lenient = Annotated[bool, typer.Option("--lenient", help="Holes of the register map read as 0 instead of being refused.")]


@command.command(cls=GroupedCommand)
@grouped
def mic488(
    firmware: Firmware = "1.70",
    units: Units = None,
    config: Annotated[Path | None, typer.Option(help="The vendor tool's .cfg file.")] = None,
    program: Program = None,
    positions: Positions = None,
    vision: Vision = None,
    statement_time: StatementTime = "1ms",
    lenient: Lenient = False,
    demo: Annotated[bool, typer.Option("--demo", help="Four spindles in mm with a switch at each end.")] = False,
    *,
    line: ModbusOptions,
    twin: TwinOptions,
    log: LogOptions,
) -> None:
    """Serve virtual MIC488 controllers.

    Without any of --pty, --serial, --tcp, --rtu-tcp, --rfc2217 and --tls-tcp it listens on a pty (where the
    system has them), on 127.0.0.1:5020 (Modbus TCP) and on
    127.0.0.1:5021 (RTU over TCP).
    """
    from steptwin.cli.serve_mic488 import ServeMic488, serve_mic488
    from steptwin.files.timedinputs import parse_duration

    controllers = ServeMic488(
        firmware=firmware,
        units=units,
        config=config,
        programs=tuple(program or ()),
        positions=tuple(positions or ()),
        vision=vision,
        statement_time=parse_duration(statement_time, "--statement-time"),
        lenient=lenient,
        gap_ms=line.gap,
        demo=demo,
    )
    ports = {"tcp": MODBUS_TCP_PORT, "rtu_tcp": RTU_TCP_PORT}
    serve_mic488(twin.on(line, "mic488", ports, log), controllers)


@command.command(cls=GroupedCommand)
@grouped
def m1486(
    variant: Annotated[
        str, typer.Option(help="Type: A, B, C, E1, E2, or A2x and so on (24 MHz).", autocompletion=completion.variants)
    ] = "A",
    chain: Annotated[str, typer.Option(help="Addresses of the chips on the line, such as 0,7; hexadecimal digits.")] = "F",
    interface: Annotated[str, typer.Option(help="Driver interface: sd, dual or two.")] = "sd",
    wire: Annotated[
        list[str] | None, typer.Option(help="Wire from a pin of one chip to an input of another: 0.B1=7.B3; repeatable.")
    ] = None,
    program: Annotated[Path | None, typer.Option(help="Program in the memory of a single chip at power-on.")] = None,
    *,
    line: ChipLineOptions,
    twin: TwinOptions,
    log: LogOptions,
) -> None:
    """Serve virtual M1486 chips on one line; several clients may be connected to it.

    Without any of --pty, --serial, --tcp and --rfc2217 it listens on a pty and on 127.0.0.1:5022 (raw TCP).
    """
    from steptwin.cli.serve_m1486 import ServeM1486, serve_m1486

    chips = ServeM1486(variant=variant, chain=chain, interface=interface, wires=tuple(wire or ()), program=program)
    serve_m1486(twin.on(line, "m1486", {"tcp": M1486_TCP_PORT}, log), chips)

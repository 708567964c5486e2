"""Options of a line and of a twin for the commands of ``steptwin serve``, and the world that is made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from steptwin.files.worldoptions import Faults, WorldRunOptions
from steptwin.live.options import LiveOptions, LogOptions, ReadyFile, UpOptions
from steptwin.options import Option, OptionGroup

if TYPE_CHECKING:
    from steptwin.languages.descriptions import Named
    from steptwin.simulation.describe.generated import Whole


@dataclass(frozen=True, kw_only=True)
class LineOptions(OptionGroup):
    """The line of a twin; the kinds of lines give the rest of its options their texts."""

    heading = "Options of the line"

    pty: Annotated[Path | None, Option("The line on a pseudo terminal, with PATH as a link to it.")] = None
    serial: Annotated[str | None, Option("The line on a real serial port, 8N1.")] = None
    rfc2217: Annotated[str | None, Option("The line as a network serial port (RFC 2217).", metavar="HOST:PORT")] = None
    tcp: str | None = None
    baud: int | None = None
    line_timing: str = "off"
    gap: float | None = None

    @property
    def links(self) -> dict[str, str | None]:
        """Addresses by keys of ``[[line]]``."""
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
class TwinOptions(OptionGroup):
    """A twin that is made from options."""

    heading = "Options of the twin"

    state: Annotated[
        Path | None, Option("Directory of the non-volatile memory. Without it, memory ends with the twin.", metavar="DIR")
    ] = None
    fault: Faults = ()
    seed: Annotated[int, Option("Random seed for faults.")] = 0
    ready_file: ReadyFile = None
    print_world: Annotated[bool, Option("Print the description of this twin as a world, for 'up', and end.")] = False
    save_world: Annotated[
        Path | None,
        Option("Write that description to FILE, with the files it names beside it, and end.", metavar="FILE", is_written=True),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Served:
    """A twin and its line, as given."""

    kind: str
    line: LineOptions
    ports: Mapping[str, int] = field(default_factory=dict)
    """Ports of a line for which no link is given, by keys of ``[[line]]``."""
    twin: TwinOptions = field(default_factory=TwinOptions)
    live: LiveOptions = field(default_factory=LiveOptions)
    log: LogOptions = field(default_factory=LogOptions)

    @property
    def name(self) -> str:
        return self.kind if self.live.name is None else self.live.name

    @property
    def links(self) -> Mapping[str, str | None]:
        """The links of the line; without any, those of ``ports`` and, where the system has them, a pseudo terminal."""
        if any(self.line.links.values()):
            return self.line.links
        host = "0.0.0.0" if self.live.listen_any else "127.0.0.1"
        return {"pty": _default_pty(self.name), **{key: f"{host}:{port}" for key, port in self.ports.items()}}

    def whole(self, **line: object) -> Whole:
        """The parts of the description that all twins have. Raises `Misuse`."""
        from steptwin.simulation.describe.generated import Whole
        from steptwin.simulation.faults import read as read_fault

        timing = None if self.line.line_timing == "off" else self.line.line_timing
        return Whole(
            name=self.name,
            line={**self.links, **self.line.tls, "baud": self.line.baud, **line, "timing": timing},
            seed=self.twin.seed,
            state=None if self.twin.state is None else str(self.twin.state),
            trace=self.live.trace,
            faults=[read_fault(fault) for fault in self.twin.fault],
        )

    def check_links(self, *others: str | None) -> None:
        """Raises `Misuse` for addresses that may not be listened at."""
        from steptwin.live.transports import TRANSPORTS
        from steptwin.simulation.toml.addresses import check_addresses

        links = (self.links.get(key) for key, transport in TRANSPORTS.items() if transport.is_address)
        check_addresses((*links, *others), listen_any=self.live.listen_any)


def _default_pty(name: str) -> str | None:
    from steptwin.live.directory import runtime_directory
    from steptwin.system import HAS_PTYS

    return str(runtime_directory() / name) if HAS_PTYS else None


def serve(served: Served, describe: Callable[[Served, Named], str]) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP; or print or save the description. Raises `Misuse` or another `SteptwinError`.

    Faults are not part of the description that is run; they are set as `up` sets those of its command line.
    """
    from steptwin.files.world import World
    from steptwin.inputfiles import read_bytes
    from steptwin.languages.descriptions import print_world, save_world
    from steptwin.live.running import up_with
    from steptwin.live.serving import check_name
    from steptwin.simulation.describe.description import read_world

    twin, name = served.twin, f"serve {served.name}"
    text = describe(replace(served, twin=replace(twin, fault=())), str)
    check_name(served.name)
    if twin.print_world:
        print_world(describe(served, str), name)
        return
    if twin.save_world is not None:
        save_world(lambda named: describe(served, named), twin.save_world)
        return
    files = {file: read_bytes(Path(file)) for file, _ in read_world(name, text).files()}
    with World.from_toml(text, files, name=name, keep_inputs=False, state=twin.state) as world:
        run = WorldRunOptions(fault=twin.fault)
        live = replace(served.live, name=served.name)
        up_with(world, UpOptions(world=None, run=run, live=live, log=served.log, ready_file=twin.ready_file))

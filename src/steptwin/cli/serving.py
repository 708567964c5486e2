"""`steptwin serve`: make a world from options and run it as `steptwin up` does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from steptwin.files.world import World
from steptwin.inputfiles import read_bytes
from steptwin.languages.descriptions import DescribeNamed, print_world, save_world
from steptwin.live.running import UpOptions, up_with
from steptwin.live.serving import check_name
from steptwin.live.telling import Telling
from steptwin.live.transports import TRANSPORTS
from steptwin.simulation.describe.description import read_world
from steptwin.simulation.describe.small import Whole
from steptwin.simulation.faults import read as read_fault
from steptwin.simulation.toml.addresses import check_addresses


@dataclass(frozen=True, slots=True, kw_only=True)
class ServeOptions:
    """The twin and its line, as given; see ``steptwin serve mic488 --help``."""

    name: str
    links: Mapping[str, str | None] = field(default_factory=dict)
    """Its links, by keys of ``[[line]]``."""
    tls: Mapping[str, str | None] = field(default_factory=dict)
    """Files of encrypted ones, by keys of ``[[line]]``."""
    baud: int | None = None
    speed: str = "1"
    control: str | None = None
    state: Path | None = None
    trace: str | None = None
    line_timing: str = "off"
    ready_file: Path | None = None
    log_frames: bool = False
    telling: Telling = field(default_factory=Telling)
    listen_any: bool = False
    faults: tuple[str, ...] = ()
    seed: int = 0
    print_world: bool = False
    save_world: Path | None = None

    def whole(self, **line: object) -> Whole:
        timing = None if self.line_timing == "off" else self.line_timing
        return Whole(
            name=self.name,
            line={**self.links, **self.tls, "baud": self.baud, **line, "timing": timing},
            seed=self.seed,
            state=None if self.state is None else str(self.state),
            trace=self.trace,
            faults=[read_fault(fault) for fault in self.faults],
        )


def check_links(options: ServeOptions, *others: str | None) -> None:
    links = (options.links.get(key) for key, transport in TRANSPORTS.items() if transport.is_address)
    check_addresses((*links, *others), listen_any=options.listen_any)


def serve(options: ServeOptions, describe: DescribeNamed, text: str) -> None:
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
                speed=options.speed,
                control=options.control,
                name=options.name,
                faults=options.faults,
                trace=options.trace,
                ready_file=options.ready_file,
                log_frames=options.log_frames,
                telling=options.telling,
                listen_any=options.listen_any,
            ),
        )

"""Random WBC programs: what is said of them, what is made of them, and what a controller does with them."""

from __future__ import annotations

from functools import partial

from chance import Chance
from random_programs import foreign, mistaken, program, restyled, rows, sound

from steptwin.diagnostics import Diagnostic, SourceText, render, split_lines
from steptwin.machine import MILLISECOND, SECOND
from steptwin.mic488.config import AxisConfig, ControllerConfig, InputConfig
from steptwin.mic488.device import Mic488Device
from steptwin.mic488.program_banks import LoadedProgram, load, setup_of
from steptwin.wbc.check import check, check_program
from steptwin.wbc.decompile import ImageError, decompile, read_image
from steptwin.wbc.dialect import dialect_for
from steptwin.wbc.image import COMMANDS_AT, build, image_of
from steptwin.wbc.incremental import Edited
from steptwin.wbc.migration import differences, findings
from steptwin.wbc.positions import PositionTable, parse_positions
from steptwin.wbc.printer import format_text
from steptwin.wbc.symbols import uses
from steptwin.wbc.syntax import parse

AXES = (
    AxisConfig(gear=10.0, acc=500.0, dec=500.0, vel=60.0, in_kl=0, limit_mode=1),
    AxisConfig(gear=10.0, acc=500.0, dec=500.0, vel=60.0),
    AxisConfig(gear=3.0, acc=50.0, dec=20.0, vel=90.0, pos_ctrl_mode=1, err_ctrl_mode=2),
    AxisConfig(gear=100.0, in_kl=2, in_kr=3, home_mode=1),
)
CONFIG = ControllerConfig(axes=AXES, inputs=(InputConfig(), *(InputConfig(interrupt=1),) * 19))
FIRMWARES = ("1.23", "1.40", "1.70")
STATEMENT_TIMES = (MILLISECOND, 700_001, 5 * MILLISECOND, MILLISECOND)
END_S = 4
MUCH = 2500


def said(chance: Chance, text: str, table: PositionTable) -> list[str]:
    """Diagnostics, with and without table and configuration, for all firmwares; the same while it is edited line by line."""
    setup = setup_of(CONFIG)
    found: list[Diagnostic] = []
    for firmware in FIRMWARES:
        found += check(text, table, setup, dialect_for(firmware)).diagnostics
    found += check(text).diagnostics
    old, new = (dialect_for(chance.one(FIRMWARES)) for _ in range(2))
    found += findings(text, old, new, table, setup)
    edited = Edited()
    lines = text.splitlines(keepends=True)
    cut = chance.below(len(lines))
    for part in ("".join(lines[:cut]), text, "".join(lines[:cut] + lines[cut + 1 :]), text):
        edited.update(part)
        assert edited.check(table, setup)[0].diagnostics == check(part, table, setup).diagnostics
    return [*differences(old, new), render(SourceText("p", text), found), *map(repr, found)]


def told(text: str) -> list[str]:
    """Diagnostics of lines, each alone and all together: what follows from a line, may hide what follows from another."""
    lines = [f"MAIN:\nBLINK:\n{line}\nJUMP MAIN\nJUMP BLINK\n" for line in text.splitlines()]
    found = [repr(found) for one in (text, *lines) for found in check(one).diagnostics]
    return [*found, *map(repr, parse(text)[0].lines), str(check(text).lines)]


def made(chance: Chance, text: str, table: PositionTable) -> list[str]:
    """How it is written, the meaning of its names, its steps, its image, and what can be read of that."""
    tree, _ = parse(text)
    checked, scope = check_program(text, tree, [], table, None, dialect_for("1.70"))
    found = [format_text(text), *(repr(use) for use in uses(tree, scope)), repr(list(split_lines(text)))]
    executable = checked.executable
    if executable is None:
        return found
    found += [repr((step.start, step.end, step)) for step in executable.steps]
    for inferred in (False, True):
        image, reasons = build(executable, table, inferred=inferred)
        found += [repr(reasons), "" if image is None else image.hex().rstrip("0")]
        if image is not None:
            back = decompile(image)
            found += [back.text, back.positions.text, f"{back.unknown} {back.inferred}"]
            found += damaged(chance, image)
    return found


def encodable(text: str, table: PositionTable) -> str:
    """The program with only what has a form in the image."""
    for _ in range(20):
        executable = check(text, table).executable
        assert executable is not None, text
        source = SourceText("", text)
        wrong = {source.position(found.span.start)[0] for found in build(executable, table, inferred=True)[1]}
        if not wrong:
            return text
        lines = []
        for number, line in enumerate(text.splitlines(), 1):
            word = line.split()[0].upper() if line.strip() else ""
            if number not in wrong:
                lines.append(line)
            elif word in ("IF", "WHILE"):
                lines.append(f"{word} IN{number % 20 + 1} = ON")
        text = sound("".join(f"{line}\n" for line in lines), table)
    raise AssertionError(text)


def damaged(chance: Chance, data: bytes) -> list[str]:
    """What can be read of an image in which records are others, or which is broken."""
    image = read_image(data)
    records = [bytearray(record) for record in image.records]
    for _ in range(4):
        record = chance.one(records)
        record[chance.one((0, 0, 1, 1, 2, 6, 12, 13, 14))] = chance.one((0, 1, 2, 3, 5, 9, 61, 255, chance.below(40)))
    changed = image_of([bytes(record) for record in records], list(image.rows))
    broken = bytearray(data)
    broken[chance.one((0, 16 * len(records), *range(COMMANDS_AT, COMMANDS_AT + 4)))] ^= 1 + chance.below(255)
    found = []
    for one in (changed, bytes(broken), data[: chance.below(len(data))]):
        try:
            back = decompile(one)
            found += [back.text, f"{back.unknown} {back.inferred}"]
        except ImageError as error:
            found.append(str(error))
    return found


class Run:
    """A controller with a program, to which something happens by chance."""

    def __init__(self, seed: int, loaded: LoadedProgram, table: PositionTable, *, rests: bool) -> None:
        chance = self.chance = Chance("run", seed)
        time = chance.one(STATEMENT_TIMES)
        device = self.device = Mic488Device(CONFIG, programs={0: loaded}, positions={0: table}, statement_time=time)
        device.program.interpreter.rests = rests
        self.found: list[str] = []
        self.statements: list[str] = []
        """Those of a loop that rests are not executed."""
        if seed % 3 == 0:
            device.program.interpreter.hook(lambda now, number: self.statements.append(f"{now} {number}"))
        self.dues: list[str] = []
        """When it acts next, seen now and then: of a loop or wait that rests, when that can end."""
        device.on_event = lambda event: self.found.append(f"{event.time} {event.code}: {event.text}")
        device.changed = self._look

    def _look(self) -> None:
        self.found += [f"{edge.time} {edge.pin} = {edge.value:g}" for edge in self.device.take_edges()]

    def run(self) -> None:
        device, chance = self.device, self.chance
        device.command(partial(device.program.command, 1), 0)
        now = 0
        while now < END_S * SECOND and len(self.found) < MUCH:
            now += int(float(chance.filled("⟨0..100|1..20|100..300⟩")) * MILLISECOND)
            device.advance(now)
            self.found.append(self._shown(now))
            self.dues.append(f"{now} {device.deadline()} {device.program.interpreter.place(now)}")
            kind = chance.below(6)
            if kind <= 2:
                device.set_pin(chance.filled("IN⟨#1..8⟩"), chance.below(2), now)
            elif kind == 3:
                device.execute(
                    bytes.fromhex(f"10 00{4 + 2 * chance.below(2):02x} 0002 04") + bytes(chance.below(9) for _ in range(4)), now
                )
            elif kind == 4:
                device.command(partial(device.program.command, chance.one((1, 2, 2, 1, 1, 0))), now)
            else:
                device.set_pin("AIN1", float(chance.filled("⟨0..10⟩")), now)

    def _shown(self, now: int) -> str:
        control = self.device.program
        axes = " ".join(f"{one.status.name} {one.coordinate_p(now)} {one.profile.velocity(now):.9g}" for one in self.device.axes)
        memory = " ".join(f"{number}={word}" for number, word in enumerate(self.device.user) if word)
        return f"{now} {control.state} {control.statement(now)} {dict(control.variables(now))} {control.fault} {axes} {memory}"


def seen(seed: int) -> dict[str, list[str]]:
    chance = Chance("wbc", seed)
    table, _ = parse_positions(rows(chance))
    raw = program(chance)
    text = restyled(chance, sound(raw, table))
    broken = mistaken(chance, raw)
    strange = foreign(chance)
    loaded = load(check(text, table))
    resting, looking = (Run(seed, loaded, table, rests=rests) for rests in (True, False))
    resting.run()
    looking.run()
    assert resting.found == looking.found
    return {
        "text": text.splitlines(),
        "says": said(chance, text, table),
        "made": made(chance, text, table),
        "does": [*resting.found, *resting.statements, *resting.dues],
        "wrong": [broken, *said(chance, broken, table), *made(chance, broken, table)],
        "image": made(chance, encodable(text, table), table),
        "foreign": [strange, *told(strange)],
    }

"""The texts in the program memories of controllers: what a description gives them, and what is put there later."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from steptwin.diagnostics import Diagnostic, SourceText, to_json
from steptwin.errors import Misuse
from steptwin.machine import Nanos
from steptwin.world.script import Step

if TYPE_CHECKING:
    from steptwin.explain.model import MemoryPart
    from steptwin.world.plant import Plant
    from steptwin.world.spec import ControllerSpec, WorldSpec

FINDING = ("line", "column", "end_line", "end_column", "severity", "code", "message", "hint")
"""Of a diagnostic as plain values (`steptwin.diagnostics.to_json`)."""


class TextLanguage(NamedTuple):
    """A language of the texts in the program memory of a kind of controllers."""

    name: str
    """For editors."""
    suffix: str
    """Of files in it."""
    key: str
    """Of the table of a controller, which names these files."""
    in_banks: bool = False
    """Whether the value of the key is a table with the number of the bank of each."""
    is_shared: bool = False
    """Whether one file that is alone in its key is that of all banks."""


def bank_text(bank: int) -> str:
    """The place of the program in a bank."""
    return f"program {bank}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramText:
    """A place in the program memory of a controller, and the text there."""

    place: str
    """Unlike all others of the controller: ``program 0``, ``positions 0``, ``program``."""
    language: TextLanguage
    """One of those of the kind of its controller."""
    source: SourceText
    check: Callable[[], Sequence[Diagnostic]]
    """What the checker of its language finds, in the order of the text."""
    memory: Callable[[str], Sequence[MemoryPart]]
    """What another text would take of the memory at this place; empty for one with errors."""
    is_empty: bool = False
    """Whether nothing is there; the text is empty then."""
    is_running: bool = False
    line: int | None = None
    """Of the present statement, from 1, while it runs or is paused; None where that is not known."""


class Destination(NamedTuple):
    """Where a text goes."""

    machine: str
    line: str | None
    """The name of its line; None where it is on none."""
    place: str


class Downloading(NamedTuple):
    """How a text that was checked comes to its place."""

    put: Callable[[Nanos], None] = lambda now: None
    """What happens at once."""
    typed: tuple[Step, ...] = ()
    """What a host types after that."""


class GivenFiles:
    """The files of a world that was built, whose warnings were reported then, and what was put into controllers since."""

    def __init__(self, plant: Plant) -> None:
        self.spec: WorldSpec = plant.spec
        self._plant = plant

    def data(self, name: str) -> bytes:
        """As `steptwin.world.kind.BuildContext.data`."""
        return self._plant.files[name]

    def accept(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """As `steptwin.world.kind.BuildContext.accept`."""

    def downloaded(self, machine: str, place: str) -> SourceText | None:
        """As `steptwin.world.kind.TextContext.downloaded`."""
        return self._plant.downloaded.get((machine, place))


def address_of(machine: str, place: str, language: TextLanguage) -> str:
    """The address under which editors know a text."""
    return f"steptwin:///{machine}/{place.replace(' ', '-')}{language.suffix}"


def program_texts(plant: Plant, machine: str) -> Sequence[ProgramText]:
    """Of a controller by name, at the present moment of the world; empty without any. Raises `Misuse` for another name."""
    if machine not in plant.machines:
        raise Misuse(f"there is no controller {machine!r}: there are {', '.join(plant.machines)}")
    plant.touch(machine)
    spec = next(one for one in plant.spec.controllers if one.name == machine)
    return spec.kind.texts(spec, plant.machines[machine], GivenFiles(plant))


def text_at(plant: Plant, machine: str, place: str) -> ProgramText:
    """Raises `Misuse` with the places there are."""
    there = {text.place: text for text in program_texts(plant, machine)}
    if place not in there:
        raise Misuse(f"{machine} has no place {place!r} for a program: places are {', '.join(there) or 'none'}")
    return there[place]


def name_of_text(plant: Plant, machine: str, place: str) -> str:
    """Of the text at a place, or of the place where nothing is there yet. Raises `Misuse`."""
    return text_at(plant, machine, place).source.name


def configuration_text(plant: Plant, machine: str) -> SourceText | None:
    """The configuration file of a controller by name; None for a kind that has none. Raises `Misuse` for another name."""
    if machine not in plant.machines:
        raise Misuse(f"there is no controller {machine!r}: there are {', '.join(plant.machines)}")
    spec = next(one for one in plant.spec.controllers if one.name == machine)
    return spec.kind.configuration(spec, plant.machines[machine], GivenFiles(plant))


class WorldPrograms:
    """Of a world, as plain values."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def list(self) -> Sequence[Mapping[str, object]]:
        """The texts of all controllers."""
        return [_plain(name, text) for name in self._plant.machines for text in program_texts(self._plant, name)]

    def text(self, machine: str, place: str) -> Mapping[str, object]:
        """One of them, with what its checker finds. Raises `Misuse`."""
        text = text_at(self._plant, machine, place)
        findings = [{key: row[key] for key in FINDING} for row in to_json(text.source, text.check())]
        return {**_plain(machine, text), "text": text.source.text, "diagnostics": findings}

    def memory(self, machine: str, place: str, text: str) -> Sequence[Mapping[str, object]]:
        """What a text takes of the memory at a place; empty for one with errors. Raises `Misuse`."""
        return [part._asdict() for part in text_at(self._plant, machine, place).memory(text)]

    def files(self) -> Mapping[str, bytes]:
        """What an editor server needs by address: texts, configurations, and a description of their controllers."""
        plant = self._plant
        data: Any = plant.spec.text.data
        found: dict[str, bytes] = {}
        tables: list[str] = []
        for spec in plant.spec.controllers:
            kind, index = spec.path
            table = data[kind][index]
            known = [key for key in ("name", *spec.kind.dialect_keys) if key in table]
            lines = [f"[[{kind}]]", *(f"{key} = {json.dumps(table[key])}" for key in known)]
            for name, key in spec.kind.files(spec):
                if key == "config":
                    found[f"steptwin:///{spec.name}/config.cfg"] = plant.files[name]
                    lines.append(f'config = "{spec.name}/config.cfg"')
            texts = program_texts(plant, spec.name)
            for text in texts:
                if not text.is_empty:
                    found[address_of(spec.name, text.place, text.language)] = text.source.text.encode()
            tables += [*lines, *_keys(spec, texts)]
        found["steptwin:///world.toml"] = "\n".join(tables).encode()
        return found


def _keys(spec: ControllerSpec, texts: Sequence[ProgramText]) -> Iterator[str]:
    """The keys of a table that name the places of its program memory. A file that is alone in its key may be that of all banks,
    so empty ones are left out there."""
    for language in spec.kind.languages:
        of_key = [text for text in texts if text.language == language]
        if language.is_shared:
            of_key = [text for text in of_key if not text.is_empty] or of_key[:1]
        if language.in_banks and of_key:
            banks = (f'{text.place.rpartition(" ")[2]} = "{_name(spec.name, text)}"' for text in of_key)
            yield f"{language.key} = {{ {', '.join(banks)} }}"
        elif of_key:
            yield f'{language.key} = "{_name(spec.name, of_key[0])}"'


def _name(machine: str, text: ProgramText) -> str:
    """Of a text, seen from the description."""
    return address_of(machine, text.place, text.language).removeprefix("steptwin:///")


def _plain(machine: str, text: ProgramText) -> Mapping[str, object]:
    return {
        "machine": machine,
        "place": text.place,
        "name": text.source.name,
        "language": text.language.name,
        "address": address_of(machine, text.place, text.language),
        "empty": text.is_empty,
        "running": text.is_running,
        "line": text.line,
    }

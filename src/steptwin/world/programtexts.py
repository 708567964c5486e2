"""The texts of programs that the description of a world gives its controllers, as they were read with it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from steptwin.diagnostics import Diagnostic, SourceText, to_json
from steptwin.errors import Misuse

if TYPE_CHECKING:
    from steptwin.world.plant import Plant
    from steptwin.world.spec import WorldSpec

WBC, CHIP, CSV = "wbc", "m1486", "csv"
LANGUAGES = (WBC, CHIP, CSV)
FINDING = ("line", "column", "end_line", "end_column", "severity", "code", "message", "hint")
"""Of a diagnostic as plain values (`steptwin.diagnostics.to_json`)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramText:
    """A text that a controller was given."""

    place: str
    """Where it is in the controller, unlike all others of it: ``program 0``, ``positions 0``, ``program``."""
    language: str
    """One of `LANGUAGES`."""
    source: SourceText
    diagnostics: Sequence[Diagnostic] = ()
    """As the checker of its language gives them, in the order of the text."""
    is_running: bool = False
    line: int | None = None
    """Of the present statement, from 1, while it runs or is paused; None where that is not known."""


class _Given:
    """The files of a world that was built. Its warnings were reported then."""

    def __init__(self, plant: Plant) -> None:
        self.spec: WorldSpec = plant.spec
        self._files = plant.files

    def data(self, name: str) -> bytes:
        """As `steptwin.world.kind.BuildContext.data`."""
        return self._files[name]

    def warn(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """As `steptwin.world.kind.BuildContext.warn`."""


def program_texts(plant: Plant, machine: str) -> Sequence[ProgramText]:
    """Of a controller by name, at the present moment of the world; empty without any. Raises `Misuse` for another name."""
    if machine not in plant.machines:
        raise Misuse(f"there is no controller {machine!r}: there are {', '.join(plant.machines)}")
    plant.touch(machine)
    spec = next(one for one in plant.spec.controllers if one.name == machine)
    return spec.kind.texts(spec, plant.machines[machine], _Given(plant))


class WorldPrograms:
    """Of a world, as plain values."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def list(self) -> Sequence[Mapping[str, object]]:
        """The texts of all controllers."""
        return [_plain(name, text) for name in self._plant.machines for text in program_texts(self._plant, name)]

    def text(self, machine: str, place: str) -> Mapping[str, object]:
        """One of them, with what its checker finds. Raises `Misuse`."""
        there = {text.place: text for text in program_texts(self._plant, machine)}
        if place not in there:
            raise Misuse(f"{machine} was given no text {place!r}: texts are {', '.join(there) or 'none'}")
        text = there[place]
        findings = [{key: row[key] for key in FINDING} for row in to_json(text.source, text.diagnostics)]
        return {**_plain(machine, text), "text": text.source.text, "diagnostics": findings}


def _plain(machine: str, text: ProgramText) -> Mapping[str, object]:
    return {
        "machine": machine,
        "place": text.place,
        "name": text.source.name,
        "language": text.language,
        "running": text.is_running,
        "line": text.line,
    }

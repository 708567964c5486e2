"""The texts in the program memories of the controllers of a world, at its present moment."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from steptwin.diagnostics import Finding, SourceText, findings
from steptwin.errors import Misuse
from steptwin.explain.model import MemoryUse
from steptwin.jsonvalues import JsonForm
from steptwin.messages import NONE, Message
from steptwin.simulation.kinds.kind import ControllerSpec
from steptwin.simulation.kinds.programs import ProgramState
from steptwin.simulation.kinds.programtexts import ProgramText, TextLanguage
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.world.model import Model

P = TypeVar("P")
_OVER = (ProgramState.STOPPED, ProgramState.SHUT_DOWN)
_LANGUAGES = JsonForm({"enum": [language.name for kind in KINDS.values() for language in kind.languages]})


@dataclass(frozen=True, slots=True)
class ShownProgram:
    """A place in the program memory of a controller."""

    controller: str
    place: Annotated[str, "Unlike all others of the controller, such as program 0."]
    name: Annotated[str, "Of the file."]
    language: Annotated[str, _LANGUAGES]
    suffix: Annotated[str, "Of files in this language."]
    has_statements: Annotated[bool, "Whether it is a program, in whose statements a debugger stops."]
    is_typed: Annotated[bool, "Whether a text is typed over the line of the controller, as at a terminal."]
    address: Annotated[str, "At the editor server."]
    empty: Annotated[bool, "Whether nothing is there yet."]
    running: bool
    line: Annotated[int | None, "Of the present statement, from 1, while it runs or is paused; null where that is not known."]


@dataclass(frozen=True, slots=True)
class ShownProgramText(ShownProgram):
    """A place with the text there, and what the checker of its language finds in it."""

    text: str
    diagnostics: tuple[Finding, ...]


def address_of(controller: str, place: str, language: TextLanguage) -> str:
    """The address under which editors know a text."""
    return f"steptwin:///{controller}/{place.replace(' ', '-')}{language.suffix}"


NO_SUCH_CONTROLLER = Message("simulation.no-such-controller", "there is no controller {controller!r}: there are {names}")


def program_texts(model: Model, controller: str) -> Sequence[ProgramText]:
    """Program texts of a controller, at the present moment of the world; empty without any. Raises `Misuse` for another name."""
    if controller not in model.controllers:
        raise Misuse(NO_SUCH_CONTROLLER(controller=controller, names=list(model.controllers)))
    model.sync(controller)
    spec = next(one for one in model.spec.controllers if one.name == controller)
    return spec.kind.texts(spec, model.controllers[controller], model.given)


NO_PLACE_FOR_A_PROGRAM = Message(
    "simulation.no-place-for-a-program", "{controller} has no place {place!r} for a program: places are {places}"
)


def text_at(model: Model, controller: str, place: str) -> ProgramText:
    """Raises `Misuse` with the places there are."""
    there = {text.place: text for text in program_texts(model, controller)}
    if place not in there:
        raise Misuse(NO_PLACE_FOR_A_PROGRAM(controller=controller, place=place, places=list(there) or NONE()))
    return there[place]


def name_of_text(model: Model, controller: str, place: str) -> str:
    """Name of the text at a place, or of the place where nothing is there yet. Raises `Misuse`."""
    return text_at(model, controller, place).source.name


def configuration_text(model: Model, controller: str) -> SourceText | None:
    """The configuration file of a controller by name; None for a kind that has none. Raises `Misuse` for another name."""
    if controller not in model.controllers:
        raise Misuse(NO_SUCH_CONTROLLER(controller=controller, names=list(model.controllers)))
    spec = next(one for one in model.spec.controllers if one.name == controller)
    return spec.kind.configuration(spec, model.controllers[controller], model.given)


class WorldPrograms:
    """Programs of a world."""

    def __init__(self, model: Model) -> None:
        self._model = model

    def list(self) -> Sequence[ShownProgram]:
        """The places of all controllers."""
        names = self._model.controllers
        return [self._shown(ShownProgram, name, text) for name in names for text in program_texts(self._model, name)]

    def text(self, controller: str, place: str) -> ShownProgramText:
        """One of them. Raises `Misuse`."""
        text = text_at(self._model, controller, place)
        return self._shown(ShownProgramText, controller, text, text.source.text, findings(text.source, text.check()))

    def _shown(self, kind: Callable[..., P], controller: str, text: ProgramText, *rest: object) -> P:
        of = text.language
        language = of.name, of.suffix, of.has_statements, of.is_typed, address_of(controller, text.place, of)
        at = text.place, text.source.name
        line = self._line(controller, text.place)
        return kind(controller, *at, *language, text.is_empty, text.is_running, line, *rest)

    def _line(self, controller: str, place: str) -> int | None:
        """That of the present statement, where it is in this text."""
        programs = self._model.programs.get(controller)
        stack = () if programs is None or programs.state in _OVER else programs.stack(self._model.now)
        if programs is None or not stack or stack[0].location.text != place:
            return None
        return programs.statements(place)[stack[0].location.number].line

    def memory(self, controller: str, place: str, text: str) -> Sequence[MemoryUse]:
        """Use of the memory at a place by a text; empty for one with errors. Raises `Misuse`."""
        return text_at(self._model, controller, place).memory(text)

    def files(self) -> Mapping[str, bytes]:
        """Files that an editor server needs, by address: texts, configurations, and a description of their controllers."""
        model = self._model
        data: Any = model.spec.text.data
        found: dict[str, bytes] = {}
        tables: list[str] = []
        for spec in model.spec.controllers:
            kind, index = spec.path
            table = data[kind][index]
            known = [key for key in ("name", *spec.kind.dialect_keys) if key in table]
            lines = [f"[[{kind}]]", *(f"{key} = {json.dumps(table[key])}" for key in known)]
            for name, key in spec.kind.files(spec):
                if key == "config":
                    found[f"steptwin:///{spec.name}/config.cfg"] = model.files[name]
                    lines.append(f'config = "{spec.name}/config.cfg"')
            texts = program_texts(model, spec.name)
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


def _name(controller: str, text: ProgramText) -> str:
    """Name of a text, seen from the description."""
    return address_of(controller, text.place, text.language).removeprefix("steptwin:///")

"""What one client sees: the texts it has open, and their analyses. No input, no output but through `Files`.

Texts go by normal addresses (`steptwin.lsp.files.normal`), whatever spelling the client uses. A change makes a new analysis of
that text only; the others of its machine are made anew when they are next asked for and something they look at has changed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from steptwin.errors import Misuse
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.config import ConfigAnalysis
from steptwin.lsp.documents import MOST_CHARACTERS, Document, TextChange
from steptwin.lsp.files import Files, NoFiles, normal, with_suffix
from steptwin.lsp.languages import SUFFIXES, Language, language_of
from steptwin.lsp.m1486.analysis import M1486Analysis
from steptwin.lsp.machines import Chip, ControllerFiles, machines_of
from steptwin.lsp.positions import Encoding, LineIndex
from steptwin.lsp.table import TableAnalysis, UsedRows
from steptwin.lsp.toolong import TooLong
from steptwin.lsp.wbc.analysis import WbcAnalysis
from steptwin.lsp.wbc.surroundings import ProgramContext
from steptwin.lsp.world.analysis import WorldAnalysis
from steptwin.lsp.world.built import ElementSignals
from steptwin.m1486.lines import STEP_DIRECTION
from steptwin.m1486.variants import DEFAULT as DEFAULT_VARIANT
from steptwin.mic488.config import ControllerConfig, examine_config
from steptwin.mic488.inifile import IniFile
from steptwin.textcodec import decode
from steptwin.wbc.dialect import DEFAULT as DEFAULT_DIALECT
from steptwin.wbc.incremental import Edited
from steptwin.wbc.positions import PositionTable, parse_positions


@dataclass
class _Kept:
    """What was made of a text: valid as long as it is the same object."""

    lines: LineIndex | None = None
    table: PositionTable | None = None
    config: ControllerConfig | None = None
    firmware: str = ""
    machines: tuple[list[ControllerFiles], list[Chip]] = field(default_factory=lambda: ([], []))


@dataclass(frozen=True)
class _Analysed:
    language: Language
    key: tuple[object, ...]
    analysis: Analysis


class EditorSession:
    """The state of one client."""

    def __init__(self, files: Files | None = None, encoding: Encoding = Encoding.UTF16) -> None:
        self.files: Files = NoFiles() if files is None else files
        self.encoding = encoding
        self._documents: dict[str, Document] = {}
        self._edited: dict[str, Edited] = {}
        self._analysed: dict[str, _Analysed] = {}
        self._outside: dict[str, tuple[object, LineIndex | None]] = {}
        self._kept: dict[str, _Kept] = {}
        self._elements: dict[str, ElementSignals] = {}
        self._worlds: list[str] | None = None
        self._beside: dict[tuple[str, str], str | None] = {}

    # -- the texts

    def open(self, uri: str, language: str, version: int, text: str) -> None:
        self._documents[normal(uri)] = Document(uri, language, version, LineIndex(text))
        self.refresh()

    def change(self, uri: str, version: int, changes: Iterable[TextChange]) -> None:
        """Raises `Misuse` for a text that is not open."""
        document = self._documents.get(normal(uri))
        if document is None:
            raise Misuse(f"{uri} is not open")
        self._documents[normal(uri)] = document.changed(version, changes, self.encoding)

    def close(self, uri: str) -> None:
        for kept in (self._documents, self._edited, self._analysed, self._elements):
            kept.pop(normal(uri), None)
        self.refresh()

    def refresh(self) -> None:
        """Files may have been added, removed or changed: search them again."""
        self._worlds = None
        self._beside.clear()

    @property
    def open_uris(self) -> list[str]:
        """The normal addresses of the open texts."""
        return list(self._documents)

    def document(self, uri: str) -> Document | None:
        return self._documents.get(normal(uri))

    def shown(self, uri: str) -> str:
        """An address as the client spells it."""
        document = self._documents.get(uri)
        return uri if document is None else document.uri

    def lines(self, uri: str) -> LineIndex | None:
        """A text, open or not; None where there is none. ``uri`` is normal."""
        document = self._documents.get(uri)
        if document is not None:
            return document.lines
        stamp = self.files.stamp(uri)
        if stamp is None:
            return None
        known = self._outside.get(uri)
        if known is None or known[0] != stamp:
            known = self._outside[uri] = (stamp, self._read(uri))
        return known[1]

    def _read(self, uri: str) -> LineIndex | None:
        try:
            return LineIndex(decode(self.files.read(uri), uri).text)
        except Misuse:
            return None

    # -- analyses

    def analysis(self, uri: str) -> Analysis | None:
        """The analysis of the present text; None if there is none, or none in a known language."""
        uri = normal(uri)
        lines = self.lines(uri)
        if lines is None:
            return None
        document = self._documents.get(uri)
        language = language_of("" if document is None else document.language, uri, lines.text)
        if language is None:
            return None
        key = (lines, *self._looked_at(uri, language))
        known = self._analysed.get(uri)
        if known is None or known.language is not language or not _same(known.key, key):
            known = self._analysed[uri] = _Analysed(language, key, self._analyse(uri, language, lines))
        return known.analysis

    def _looked_at(self, uri: str, language: Language) -> tuple[object, ...]:
        """What the analysis of a text depends on beside the text."""
        match language:
            case Language.WBC:
                around = self._surroundings(uri)
                return around.positions, around.config, around.dialect
            case Language.M1486:
                chip = self._chip(uri)
                return () if chip is None else (chip.variant, chip.interface)
            case Language.CONFIG:
                return (self._firmware(uri),)
            case Language.WORLD:
                return tuple(self.lines(file) for file in self._files_of(uri))
            case Language.POSITIONS:
                return (self._used_rows(uri),)

    def _analyse(self, uri: str, language: Language, lines: LineIndex) -> Analysis:
        if len(lines.text) > MOST_CHARACTERS:
            return TooLong(uri, lines)
        match language:
            case Language.WBC:
                edited = self._edited.setdefault(uri, Edited())
                edited.update(lines.text)
                return WbcAnalysis(uri, lines, edited, self._surroundings(uri))
            case Language.M1486:
                chip = self._chip(uri)
                if chip is None:
                    return M1486Analysis(uri, lines, DEFAULT_VARIANT, STEP_DIRECTION)
                return M1486Analysis(uri, lines, chip.variant, chip.interface)
            case Language.CONFIG:
                return ConfigAnalysis(uri, lines, self._firmware(uri))
            case Language.POSITIONS:
                return TableAnalysis(uri, lines, self._used_rows(uri))
            case Language.WORLD:
                return WorldAnalysis(uri, lines, _Around(self), self._elements.setdefault(uri, ElementSignals()))

    # -- the files of a machine

    def _keep(self, uri: str) -> _Kept:
        """What is kept of a text as it is now."""
        lines = self.lines(uri)
        kept = self._kept.get(uri)
        if kept is None or kept.lines is not lines:
            kept = self._kept[uri] = _Kept(lines)
        return kept

    def _table(self, uri: str | None) -> PositionTable | None:
        kept = None if uri is None else self._keep(uri)
        if kept is None or kept.lines is None:
            return None
        if kept.table is None:
            kept.table, _ = parse_positions(kept.lines.text)
        return kept.table

    def _config(self, uri: str | None, firmware: str) -> ControllerConfig | None:
        kept = None if uri is None else self._keep(uri)
        if kept is None or kept.lines is None:
            return None
        if kept.config is None or kept.firmware != firmware:
            kept.config, _ = examine_config(IniFile.of_text(kept.lines.text, uri or ""), firmware)
            kept.firmware = firmware
        return kept.config

    def _surroundings(self, program: str) -> ProgramContext:
        controller = self._controller(program)
        table = (controller.table_of(program) if controller else None) or self.beside(program, ".csv")
        config = (controller.config if controller else None) or self.beside(program, ".cfg")
        dialect = controller.dialect if controller else DEFAULT_DIALECT
        return ProgramContext(self._table(table), self._config(config, dialect.firmware), dialect)

    def _firmware(self, config: str) -> str:
        return next((c.dialect.firmware for c in self._controllers() if c.config == config), DEFAULT_DIALECT.firmware)

    def _used_rows(self, table: str) -> UsedRows | None:
        """What programs use of a table; None where there is no program."""
        programs = [analysis for uri in self.programs_of(table) if isinstance(analysis := self.analysis(uri), WbcAnalysis)]
        if not programs:
            return None
        used = [program.used_rows for program in programs]
        names = frozenset[str]().union(*(rows.names for rows in used))
        numbers = frozenset[int]().union(*(rows.numbers for rows in used))
        return UsedRows(names, numbers, any(rows.all_may_be for rows in used))

    def beside(self, uri: str, suffix: str) -> str | None:
        """The file of the same name with another ending, open or not."""
        key = uri, suffix
        if key not in self._beside:
            names = (with_suffix(uri, suffix), with_suffix(uri, suffix.upper()))
            self._beside[key] = next((name for name in names if self._exists(name)), None)
        return self._beside[key]

    def _exists(self, uri: str) -> bool:
        return uri in self._documents or self.files.stamp(uri) is not None

    def _controllers(self) -> Iterable[ControllerFiles]:
        return (controller for world in self.worlds() for controller in self._machines(world)[0])

    def _controller(self, program: str) -> ControllerFiles | None:
        return next((c for c in self._controllers() if program in c.programs.values()), None)

    def _chip(self, program: str) -> Chip | None:
        return next((chip for world in self.worlds() for chip in self._machines(world)[1] if chip.program == program), None)

    def _machines(self, world: str) -> tuple[list[ControllerFiles], list[Chip]]:
        """Those of a world; while its text is not valid TOML, during typing, the previous ones."""
        before = self._kept.get(world)
        kept = self._keep(world)
        if kept is not before and kept.lines is not None:
            try:
                kept.machines = machines_of(world, kept.lines.text)
            except Misuse:
                kept.machines = ([], []) if before is None else before.machines
        return kept.machines

    def worlds(self) -> list[str]:
        """The worlds that are open, and those in the folders of open texts."""
        if self._worlds is None:
            found: dict[str, None] = {}
            for uri in self._documents:
                found.update(dict.fromkeys([uri] if uri.endswith(".toml") else []))
                found.update(dict.fromkeys(self.files.beside(uri, ".toml")))
            self._worlds = [uri for uri in found if self._is_world(uri)]
        return self._worlds

    def _is_world(self, uri: str) -> bool:
        document = self._documents.get(uri)
        lines = self.lines(uri)
        name = "" if document is None else document.language
        return lines is not None and language_of(name, uri, lines.text) is Language.WORLD

    def _files_of(self, world: str) -> list[str]:
        controllers, chips = self._machines(world)
        return [*(file for controller in controllers for file in controller.files), *(chip.program for chip in chips)]

    def programs_of(self, table: str) -> list[str]:
        """The programs that use a position table."""
        found = [
            program
            for controller in self._controllers()
            for program in controller.programs.values()
            if controller.table_of(program) == table
        ]
        same_name = self.beside(table, ".prg")
        return list(dict.fromkeys([*found, *([same_name] if same_name else [])]))

    def related(self, uri: str) -> list[str]:
        """The other files of the machines that a file belongs to, normal addresses."""
        uri = normal(uri)
        found: dict[str, None] = {}
        for suffix in (".prg", ".csv", ".cfg"):
            other = self.beside(uri, suffix)
            if other is not None:
                found[other] = None
        for world in self.worlds():
            controllers, chips = self._machines(world)
            for controller in controllers:
                files = [*controller.files]
                if uri in files or uri == world:
                    found.update(dict.fromkeys([world, *files]))
            for chip in chips:
                if uri in (chip.program, world):
                    found.update(dict.fromkeys([world, chip.program]))
        found.pop(uri, None)
        return list(found)

    def affected(self, uri: str) -> list[str]:
        """The open texts whose diagnostics may change with this one; itself first."""
        uri = normal(uri)
        return [uri, *(other for other in self.related(uri) if other in self._documents)]


class _Around:
    """The files of a world, as the session has them."""

    def __init__(self, session: EditorSession) -> None:
        self._session = session

    def read(self, uri: str) -> bytes:
        document = self._session.document(uri)
        return self._session.files.read(uri) if document is None else document.text.encode("utf-8", "surrogatepass")

    def beside(self, uri: str) -> Sequence[str]:
        files = self._session.files
        return [file for suffix in SUFFIXES for file in files.beside(uri, suffix) if file != uri]


def _same(a: tuple[object, ...], b: tuple[object, ...]) -> bool:
    """Texts, tables and configurations are the same when they are the same object; stamps and the like when they are equal."""
    return len(a) == len(b) and all(
        one is other or (not isinstance(one, LineIndex) and one == other) for one, other in zip(a, b, strict=True)
    )

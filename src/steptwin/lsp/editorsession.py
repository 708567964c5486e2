"""View of one client: the texts it has open, and their analyses. No input, no output but through `Files`.

Texts go by normal addresses (`steptwin.lsp.files.normal`), whatever spelling the client uses. A change makes a new analysis of
that text only; the others of its controller are made anew when they are next asked for and something they read has changed.
What a language needs of the session is `steptwin.lsp.language.OtherTexts`.

A question may be interrupted at any place by an exception. So what is made of a text is stored when it is complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

from steptwin.errors import Misuse
from steptwin.lsp.analysis import Analysis
from steptwin.lsp.documents import Document, TextChange
from steptwin.lsp.files import Files, NoFiles, normal, with_suffix
from steptwin.lsp.language import ControllerFiles, EditorLanguage
from steptwin.lsp.languages import LANGUAGES, language_of
from steptwin.lsp.positions import Encoding, LineIndex
from steptwin.lsp.toolong import TooLong
from steptwin.textcodec import decode

T = TypeVar("T")
M = TypeVar("M", bound=ControllerFiles)


@dataclass
class _Derived:
    """Value that was made of a text: valid as long as it is the same object."""

    lines: LineIndex
    made: dict[tuple[object, ...], Any] = field(default_factory=dict)
    controllers: Sequence[ControllerFiles] = ()


@dataclass(frozen=True)
class _Analysed:
    language: EditorLanguage
    key: tuple[object, ...]
    analysis: Analysis


class EditorSession:
    """The state of one client."""

    def __init__(self, files: Files | None = None, encoding: Encoding = Encoding.UTF16) -> None:
        self.files: Files = NoFiles() if files is None else files
        self.encoding = encoding
        self._documents: dict[str, Document] = {}
        self._analysed: dict[str, _Analysed] = {}
        self._outside: dict[str, tuple[object, LineIndex | None]] = {}
        self._derived: dict[str, _Derived] = {}
        self._kept: dict[str, dict[Callable[[], Any], Any]] = {}
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
        for kept in (self._documents, self._kept, self._analysed):
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

    def spelled(self, uri: str) -> str:
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
        language = self._language(uri, lines)
        if language is None:
            return None
        key = (lines, *language.around(self, uri))
        known = self._analysed.get(uri)
        if known is None or known.language is not language or not _same(known.key, key):
            known = self._analysed[uri] = _Analysed(language, key, self._analyse(uri, language, lines))
        return known.analysis

    def _analyse(self, uri: str, language: EditorLanguage, lines: LineIndex) -> Analysis:
        most = language.most_characters
        try:
            return TooLong(uri, lines, most) if len(lines.text) > most else language.analyse(self, uri, lines)
        except BaseException:
            self._kept.pop(uri, None)  # it may have the new text in part
            raise

    # -- what languages need

    def derived(self, uri: str | None, make: Callable[..., T], *arguments: object) -> T | None:
        """See `OtherTexts.derived`."""
        derived = None if uri is None else self._of_present_text(uri)
        if derived is None:
            return None
        key = (make, *arguments)
        if key not in derived.made:
            derived.made[key] = make(uri, derived.lines.text, *arguments)
        return cast("T", derived.made[key])

    def _of_present_text(self, uri: str) -> _Derived | None:
        lines = self.lines(uri)
        if lines is None:
            return None
        found = self._derived.get(uri)
        if found is None or found.lines is not lines:
            found = self._derived[uri] = _Derived(lines, controllers=self._read_controllers(uri, lines, found))
        return found

    def kept(self, uri: str, make: Callable[[], T]) -> T:
        """See `OtherTexts.kept`."""
        kept = self._kept.setdefault(uri, {})
        if make not in kept:
            kept[make] = make()
        return cast("T", kept[make])

    def read(self, uri: str) -> bytes:
        """See `OtherTexts.read`."""
        document = self.document(uri)
        return self.files.read(uri) if document is None else document.text.encode("utf-8", "surrogatepass")

    def in_folder(self, uri: str) -> Sequence[str]:
        """See `OtherTexts.in_folder`."""
        return [file for one in LANGUAGES.values() for file in self.files.beside(uri, one.suffix) if file != uri]

    # -- the files of a controller

    def beside(self, uri: str, suffix: str) -> str | None:
        """The file of the same name with another ending, open or not."""
        key = uri, suffix
        if key not in self._beside:
            names = (with_suffix(uri, suffix), with_suffix(uri, suffix.upper()))
            self._beside[key] = next((name for name in names if self._exists(name)), None)
        return self._beside[key]

    def _exists(self, uri: str) -> bool:
        return uri in self._documents or self.files.stamp(uri) is not None

    def controllers(self, kind: type[M]) -> Iterator[M]:
        """See `OtherTexts.controllers`."""
        return (controller for world in self.worlds() for controller in self._controllers(world) if isinstance(controller, kind))

    def files_of(self, world: str) -> Iterator[str]:
        """See `OtherTexts.files_of`."""
        return (file for controller in self._controllers(world) for file in controller.files)

    def _controllers(self, world: str) -> Sequence[ControllerFiles]:
        derived = self._of_present_text(world)
        return () if derived is None else derived.controllers

    def _read_controllers(self, uri: str, lines: LineIndex, before: _Derived | None) -> Sequence[ControllerFiles]:
        """Those that a text describes; while it cannot be read, during typing, the previous ones."""
        language = self._language(uri, lines)
        if language is None:
            return ()
        try:
            return language.controllers(uri, lines.text)
        except Misuse:
            return () if before is None else before.controllers

    def _language(self, uri: str, lines: LineIndex) -> EditorLanguage | None:
        document = self._documents.get(uri)
        return language_of("" if document is None else document.language, uri, lines.text)

    def worlds(self) -> list[str]:
        """The worlds that are open, and those in the folders of open texts."""
        if self._worlds is None:
            found: dict[str, None] = {}
            for uri in self._documents:
                for suffix in (one.suffix for one in LANGUAGES.values() if one.offers(EditorLanguage.controllers)):
                    found.update(dict.fromkeys([uri] if uri.endswith(suffix) else []))
                    found.update(dict.fromkeys(self.files.beside(uri, suffix)))
            self._worlds = [uri for uri in found if self._is_world(uri)]
        return self._worlds

    def _is_world(self, uri: str) -> bool:
        lines = self.lines(uri)
        language = None if lines is None else self._language(uri, lines)
        return language is not None and language.offers(EditorLanguage.controllers)

    def related(self, uri: str) -> list[str]:
        """The other files of the controllers that a file belongs to, normal addresses."""
        uri = normal(uri)
        found: dict[str, None] = {}
        for language in LANGUAGES.values():
            other = self.beside(uri, language.suffix) if language.shares_name else None
            if other is not None:
                found[other] = None
        for world in self.worlds():
            for controller in self._controllers(world):
                files = [*controller.files]
                if uri in files or uri == world:
                    found.update(dict.fromkeys([world, *files]))
        found.pop(uri, None)
        return list(found)

    def affected(self, uri: str) -> list[str]:
        """The open texts whose diagnostics may change with this one; itself first."""
        uri = normal(uri)
        return [uri, *(other for other in self.related(uri) if other in self._documents)]


def _same(a: tuple[object, ...], b: tuple[object, ...]) -> bool:
    """Texts, tables and configurations are the same when they are the same object; stamps and the like when they are equal."""
    return len(a) == len(b) and all(
        one is other or (not isinstance(one, LineIndex) and one == other) for one, other in zip(a, b, strict=True)
    )

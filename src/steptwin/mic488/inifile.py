"""INI files kept byte for byte: unknown sections and keys, order, blank lines, comments, line ends and encoding stay.

A file is a value: changing a key gives a new file in which only that key's value differs. Names of sections and keys are
matched without regard to case, and of a repeated key the first counts, as Windows programs read such files.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from steptwin.diagnostics import Diagnostic, Fix, Severity, SourceText, Span, in_order
from steptwin.errors import Misuse
from steptwin.messages import Message

_LINE = re.compile(r"([^\r\n]*)(\r\n|\r|\n|\Z)")
_TRAILING_COMMENT = re.compile(r"\s[;#]")
_COMMENT_SIGNS = (";", "#", "//")
_BYTE_ORDER_MARK = "\ufeff"
_UTF_16 = ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"))


@dataclass(frozen=True, slots=True)
class IniEntry:
    """A key with its value as written. Spans count characters of the text."""

    section: str
    key: str
    value: str
    key_span: Span
    value_span: Span


@dataclass(frozen=True, slots=True)
class Header:
    """A ``[section]`` line."""

    section: str
    span: Span


WOULD_NOT_READ_BACK = Message(
    "mic488.would-not-read-back", "[{section}] {key} = {value!r} cannot be written to {name}: it would not read back"
)
NOT_IN_THE_ENCODING = Message(
    "mic488.not-in-the-encoding", "[{section}] {key}: {value!r} has characters that {name} cannot hold: {problem}"
)


@dataclass(frozen=True)
class IniFile:
    """The text of a file and the places of its entries. `parse` makes it, `to_bytes` writes it."""

    source: SourceText
    encoding: str
    headers: tuple[Header, ...]
    entries: tuple[IniEntry, ...]
    findings: tuple[Diagnostic, ...]
    """Diagnostics of the form of the file: codes C001–C004."""

    @classmethod
    def parse(cls, data: bytes, name: str = "configuration") -> IniFile:
        """Read a file. Any bytes are accepted: lines that are no INI are kept and reported in ``findings``.

        Text is UTF-8, UTF-16 with a byte order mark or, where it is neither, Windows code page 1250.
        """
        try:
            encoding = next((encoding for mark, encoding in _UTF_16 if data.startswith(mark)), None)
            if encoding is not None:
                return _read(SourceText(name, data.decode(encoding)), encoding)
            return _read(SourceText(name, data.decode("utf-8")), "utf-8")
        except UnicodeDecodeError:
            # Bytes outside the code page survive as surrogates, so that every file is written back as it was.
            return _read(SourceText(name, data.decode("cp1250", "surrogateescape")), "cp1250")

    @classmethod
    def of_text(cls, text: str, name: str = "configuration") -> IniFile:
        """A file that is being edited."""
        return _read(SourceText(name, text), "utf-8")

    def to_bytes(self) -> bytes:
        """The file; unchanged, the very bytes it was parsed from."""
        return self.source.text.encode(self.encoding, "surrogateescape")

    @cached_property
    def _by_name(self) -> dict[tuple[str, str], IniEntry]:
        found: dict[tuple[str, str], IniEntry] = {}
        for entry in self.entries:
            found.setdefault((entry.section.lower(), entry.key.lower()), entry)
        return found

    def find(self, section: str, key: str) -> IniEntry | None:
        """The entry that counts for a key, None when there is none."""
        return self._by_name.get((section.lower(), key.lower()))

    def get(self, section: str, key: str) -> str | None:
        """Its value as written."""
        entry = self.find(section, key)
        return None if entry is None else entry.value

    def with_value(self, section: str, key: str, value: str) -> IniFile:
        """The file in which ``key`` has ``value``; a missing key goes to the end of its section, a missing section to the end.

        Raises `Misuse` for names and values that would not read back as they are (line ends, outer blanks, a comment sign
        after a blank, ``=`` in a key) and for characters the file's encoding does not have.
        """
        text = self.source.text
        entry = self.find(section, key)
        if entry is not None:
            start, end = entry.value_span.start, entry.value_span.end
            inserted = value
        else:
            start = end = self._place(section)
            inserted = self._new_lines(section, key, value, start)
        changed = _read(SourceText(self.source.name, text[:start] + inserted + text[end:]), self.encoding)
        wanted = self._values() | {(section.lower(), key.lower()): value}
        if changed._values() != wanted or len(changed.findings) != len(self.findings):
            raise Misuse(WOULD_NOT_READ_BACK(section=section, key=key, value=value, name=self.source.name))
        try:
            changed.to_bytes()
        except UnicodeEncodeError as error:
            raise Misuse(
                NOT_IN_THE_ENCODING(section=section, key=key, value=value, name=self.source.name, problem=error)
            ) from None
        return changed

    def _values(self) -> dict[tuple[str, str], str]:
        return {name: entry.value for name, entry in self._by_name.items()}

    def _place(self, section: str) -> int:
        """The place of a new key of ``section``: the line after its last entry or its header, else the end."""
        ends = [h.span.end for h in self.headers if h.section.lower() == section.lower()]
        ends += [e.value_span.end for e in self.entries if e.section.lower() == section.lower()]
        if not ends:
            return len(self.source.text)
        line = _LINE.match(self.source.text, max(ends))
        return line.end() if line else len(self.source.text)

    def _new_lines(self, section: str, key: str, value: str, place: int) -> str:
        text = self.source.text
        first = _LINE.match(text)
        end = (first.group(2) if first else "") or "\r\n"
        known = any(h.section.lower() == section.lower() for h in self.headers)
        unfinished = place > 0 and text[place - 1] not in "\r\n" and text[:place] != _BYTE_ORDER_MARK
        return f"{end if unfinished else ''}{'' if known else f'[{section}]{end}'}{key}={value}{end}"


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Start and text of each line, without its end. (``str.splitlines`` knows line ends that INI files do not.)"""
    for line in _LINE.finditer(text, len(_BYTE_ORDER_MARK) if text.startswith(_BYTE_ORDER_MARK) else 0):
        yield line.start(), line.group(1)


def _read(source: SourceText, encoding: str) -> IniFile:
    headers: list[Header] = []
    entries: list[IniEntry] = []
    findings: list[Diagnostic] = []

    def find(code: str, severity: Severity, span: Span, message: str, hint: str | None = None, fix: Fix | None = None) -> None:
        findings.append(Diagnostic(code, severity, span, message, hint, fix))

    binary = source.text.find("\0")
    if binary >= 0:
        find("C004", Severity.ERROR, Span(binary, binary + 1), "the file is not text", "save it as ANSI or UTF-8")
    for start, line in () if binary >= 0 else _lines(source.text):
        stripped = line.strip()
        span = Span(start + len(line) - len(line.lstrip()), start + len(line.rstrip()))
        if not stripped or stripped.startswith(_COMMENT_SIGNS):
            continue
        if stripped.startswith("["):
            name, bracket, _ = stripped[1:].partition("]")
            span = Span(span.start, span.start + 1 + len(name) + len(bracket))
            if not bracket:
                begun = stripped.split(";", 1)[0].rstrip()
                fix = Fix(Span(span.start, span.start + len(begun)), f"{begun}]")
                find("C002", Severity.ERROR, span, f"the section header {stripped} is not closed", "permitted: [name]", fix)
            headers.append(Header(name.strip(), span))
        elif (entry := _entry(line, start, headers[-1].section if headers else None)) is not None:
            entries.append(entry)
        elif headers or "=" not in line:
            hint, fix = "permitted: [section], key=value, ; comment", Fix(Span(span.start, span.start), "; ")
            find("C001", Severity.WARNING, span, f"{stripped!r} has no effect", hint, fix)
        else:
            find("C001", Severity.WARNING, span, f"{stripped!r} is before the first [section] and has no effect")
    findings += _repeated(headers, entries)
    return IniFile(source, encoding, tuple(headers), tuple(entries), tuple(in_order(findings)))


def _entry(line: str, start: int, section: str | None) -> IniEntry | None:
    equals = line.find("=")
    key = line[:equals].strip()
    if equals < 0 or not key or section is None:
        return None
    comment = _TRAILING_COMMENT.search(line, equals + 1)
    written = line[equals + 1 : comment.start() if comment else len(line)]
    value = written.strip()
    key_start = start + line.index(key)
    value_start = start + equals + 1 + (len(written) - len(written.lstrip()) if value else 0)
    return IniEntry(section, key, value, Span(key_start, key_start + len(key)), Span(value_start, value_start + len(value)))


def _repeated(headers: list[Header], entries: list[IniEntry]) -> Iterator[Diagnostic]:
    sections: set[str] = set()
    for header in headers:
        if header.section.lower() in sections:
            yield Diagnostic("C003", Severity.WARNING, header.span, f"the section [{header.section}] is repeated")
        sections.add(header.section.lower())
    keys: set[tuple[str, str]] = set()
    for entry in entries:
        name = (entry.section.lower(), entry.key.lower())
        if name in keys:
            message = f"[{entry.section}] {entry.key} is repeated; the first one counts"
            fix = Fix(Span(entry.key_span.start, entry.key_span.start), "; ")
            yield Diagnostic("C003", Severity.WARNING, entry.key_span, message, fix=fix)
        keys.add(name)

"""Configuration files of controllers as forms, as plain values: `steptwin.configuration`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from steptwin.configuration import ConfigurationFormat, ConfigurationKey, Form, Section
from steptwin.datasheet import Datasheet, plain
from steptwin.diagnostics import SourceText, to_json
from steptwin.errors import Refusal
from steptwin.studio.machines import Sheets
from steptwin.world.kinds import KINDS
from steptwin.world.programtexts import FINDING


class Configurations:
    """Of the controllers of a subject. ``given``: the file of a controller by name, None without one."""

    def __init__(self, sheets: Sheets, given: Callable[[str], SourceText | None]) -> None:
        self._sheets = sheets
        self._given = given

    def read(self, machine: str) -> Mapping[str, object]:
        """That with which it runs. Raises `Misuse` for another name, `Refusal` for a kind without such a file."""
        kind, sheet = self._kind(machine)
        source = self._given(machine) or SourceText(f"{machine}.cfg", "")
        return _plain(kind.form(source.text, source.name, sheet))

    def edit(self, machine: str, text: str, changes: Mapping[str, str]) -> Mapping[str, object]:
        """A text with other values. Raises as `read`, and `Misuse` for settings that are not there."""
        kind, sheet = self._kind(machine)
        name = f"{machine}.cfg"
        return _plain(kind.form(kind.with_values(text, name, changes), name, sheet))

    def _kind(self, machine: str) -> tuple[ConfigurationFormat, Datasheet]:
        sheet = self._sheets.of(machine)
        kind = KINDS.get(sheet.kind)
        if kind is None or kind.configuration_format is None:
            raise Refusal(f"{machine} is of the kind {sheet.kind}, which has no configuration file: it is set up by commands")
        return kind.configuration_format, sheet


def _plain(form: Form) -> Mapping[str, object]:
    findings = [{key: row[key] for key in FINDING} for row in to_json(form.source, form.diagnostics)]
    return {
        "name": form.source.name,
        "text": form.source.text,
        "sections": [_section(one) for one in form.sections],
        "diagnostics": findings,
        "points": dict(form.points),
    }


def _section(section: Section) -> Mapping[str, object]:
    return {"name": section.name, "title": section.title, "settings": [_setting(one) for one in section.settings]}


def _setting(setting: ConfigurationKey) -> Mapping[str, object]:
    return plain(setting)

"""Configurations of controllers as forms, as plain values: `steptwin.configuration`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence

from steptwin.configuration import ConfigurationFormat, Form
from steptwin.datasheet import Datasheet
from steptwin.diagnostics import SourceText, findings
from steptwin.errors import Refusal
from steptwin.messages import Message
from steptwin.simulation.kinds.registry import KINDS
from steptwin.studio.controllers import Sheets
from steptwin.studio.toolrequests import ConfigurationForm
from steptwin.subject.contract import Reading

NO_CONFIGURATION_FILE = Message(
    "studio.no-configuration-file",
    "{controller} is of the kind {kind}, which has no configuration file: it is set up by commands",
)


class Configurations:
    """Configurations of controllers. ``given``: their files by name, None without one; ``present`` reads points."""

    def __init__(
        self,
        sheets: Sheets,
        given: Callable[[str], Awaitable[SourceText | None]],
        present: Callable[[Sequence[str]], Awaitable[Sequence[Reading]]],
    ) -> None:
        self._sheets = sheets
        self._given = given
        self._present = present

    async def read(self, controller: str) -> ConfigurationForm:
        """Its file; without one, what its registers show. Raises `Misuse` for another name, `Refusal` for a kind without such a
        file, `LineFailure`."""
        kind, sheet = self._kind(controller)
        source = await self._given(controller)
        if source is not None:
            return _shown(kind.form(source.text, source.name, sheet), is_file=True)
        name = f"{controller}.cfg"
        paths = [
            setting.point for section in kind.form("", name, sheet).sections for setting in section.settings if setting.point
        ]
        readings = await self._present([f"{controller}.{path}" for path in paths])
        values = {path: (reading.value, reading.unit) for path, reading in zip(paths, readings, strict=True)}
        text = kind.with_values("", name, kind.known(values, sheet))
        return _shown(kind.form(text, name, sheet), is_file=False)

    def edit(self, controller: str, text: str, changes: Mapping[str, str]) -> ConfigurationForm:
        """A text with other values. Raises `Misuse`, also for settings that are not there, and `Refusal` as `read`."""
        kind, sheet = self._kind(controller)
        name = f"{controller}.cfg"
        return _shown(kind.form(kind.with_values(text, name, changes), name, sheet), is_file=True)

    def _kind(self, controller: str) -> tuple[ConfigurationFormat, Datasheet]:
        sheet = self._sheets.of(controller)
        kind = KINDS.get(sheet.kind)
        if kind is None or kind.configuration_format is None:
            raise Refusal(NO_CONFIGURATION_FILE(controller=controller, kind=sheet.kind))
        return kind.configuration_format, sheet


def _shown(form: Form, *, is_file: bool) -> ConfigurationForm:
    found = findings(form.source, form.diagnostics)
    return ConfigurationForm(form.source.name, form.source.text, form.sections, found, is_file, form.points)

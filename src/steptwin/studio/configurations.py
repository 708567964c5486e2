"""Configurations of controllers as forms, as plain values: `steptwin.configuration`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping, Sequence

from steptwin.configuration import ConfigurationFormat, Form
from steptwin.datasheet import Datasheet
from steptwin.diagnostics import SourceText, diagnostics_to_json
from steptwin.errors import Refusal
from steptwin.jsonvalues import to_json
from steptwin.messages import Message
from steptwin.simulation.kinds.registry import KINDS
from steptwin.simulation.world.worldprograms import FINDING
from steptwin.studio.controllers import Sheets
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

    async def read(self, controller: str) -> Mapping[str, object]:
        """Its file; without one, what its registers show. Raises `Misuse` for another name, `Refusal` for a kind without such a
        file, `LineFailure`."""
        kind, sheet = self._kind(controller)
        source = await self._given(controller)
        if source is not None:
            return {**_to_json(kind.form(source.text, source.name, sheet)), "is_file": True}
        name = f"{controller}.cfg"
        paths = [
            setting.point for section in kind.form("", name, sheet).sections for setting in section.settings if setting.point
        ]
        readings = await self._present([f"{controller}.{path}" for path in paths])
        values = {path: (reading.value, reading.unit) for path, reading in zip(paths, readings, strict=True)}
        text = kind.with_values("", name, kind.known(values, sheet))
        return {**_to_json(kind.form(text, name, sheet)), "is_file": False}

    def edit(self, controller: str, text: str, changes: Mapping[str, str]) -> Mapping[str, object]:
        """A text with other values. Raises `Misuse`, also for settings that are not there, and `Refusal` as `read`."""
        kind, sheet = self._kind(controller)
        name = f"{controller}.cfg"
        return {**_to_json(kind.form(kind.with_values(text, name, changes), name, sheet)), "is_file": True}

    def _kind(self, controller: str) -> tuple[ConfigurationFormat, Datasheet]:
        sheet = self._sheets.of(controller)
        kind = KINDS.get(sheet.kind)
        if kind is None or kind.configuration_format is None:
            raise Refusal(NO_CONFIGURATION_FILE(controller=controller, kind=sheet.kind))
        return kind.configuration_format, sheet


def _to_json(form: Form) -> Mapping[str, object]:
    findings = [{key: row[key] for key in FINDING} for row in diagnostics_to_json(form.source, form.diagnostics)]
    return {
        "name": form.source.name,
        "text": form.source.text,
        "sections": [to_json(one) for one in form.sections],
        "diagnostics": findings,
        "points": dict(form.points),
    }

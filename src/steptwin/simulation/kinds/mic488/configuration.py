"""The configuration file of a MIC488, the vendor's ``.cfg``, as a form."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.configuration import Form
from steptwin.datasheet import Datasheet
from steptwin.mic488 import configform


class Mic488Configuration:
    """See `steptwin.configuration.ConfigurationFormat`."""

    def form(self, text: str, name: str, sheet: Datasheet) -> Form:
        return configform.config_form(text, name, sheet.variant, [axis.pulses_per_unit for axis in sheet.axes])

    def with_values(self, text: str, name: str, changes: Mapping[str, str]) -> str:
        return configform.with_values(text, name, changes)

    def known(self, values: Mapping[str, tuple[float | None, str]], sheet: Datasheet) -> Mapping[str, str]:
        return configform.known_settings(values, [(axis.unit, axis.pulses_per_unit) for axis in sheet.axes])

"""A configuration as the text of the vendor tool's ``.cfg`` file: what `steptwin.mic488.config.read_config` reads."""

from __future__ import annotations

from collections.abc import Iterable

from steptwin.mic488.config import (
    ADDRESS_KEY,
    ANALOG_KEYS,
    AXIS_KEYS,
    BAUD_KEY,
    INPUT_KEYS,
    TRIGGER_KEYS,
    ConfigKey,
    ControllerConfig,
    program_keys,
)
from steptwin.mic488.registermap import Firmware


def config_text(config: ControllerConfig, firmware: Firmware) -> str:
    """Every key that a firmware has, with its value. The address of COM2, which is not read, is left out."""
    sections: list[tuple[str, list[str]]] = [
        *((f"Axis{n}", _lines(axis, AXIS_KEYS)) for n, axis in enumerate(config.axes)),
        *((f"IN{n}", _lines(one, INPUT_KEYS)) for n, one in enumerate(config.inputs)),
        ("AIN0", [*_lines(config.analog[0], ANALOG_KEYS), *_lines(config.ports[0], (BAUD_KEY, ADDRESS_KEY))]),
        ("AIN1", [*_lines(config.analog[1], ANALOG_KEYS), *_lines(config.ports[1], (BAUD_KEY,))]),
        ("WBC_PROGRAM", _lines(config.program, program_keys(firmware))),
        ("TRIGGER", _lines(config, TRIGGER_KEYS)),
    ]
    return "\n".join("\n".join([f"[{name}]", *lines, ""]) for name, lines in sections)


def _lines(values: object, keys: Iterable[ConfigKey]) -> list[str]:
    return [f"{key.name}={getattr(values, key.attribute)}" for key in keys]

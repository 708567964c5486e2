"""The packages and modules that touch no clock, file, socket, thread or chance: those of the contract in ``pyproject.toml``."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

_PROJECT = Path(__file__).parents[2] / "pyproject.toml"


def _contract(name: str) -> dict[str, Any]:
    contracts = tomllib.loads(_PROJECT.read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (found,) = (contract for contract in contracts if contract["id"] == name)
    return found


def pure_packages() -> tuple[str, ...]:
    """Names below ``steptwin``."""
    return tuple(module.removeprefix("steptwin.") for module in _contract("pure")["source_modules"])


def packages_up_to(highest: str) -> set[str]:
    """Names below ``steptwin`` of the layers up to the one that has ``highest``."""
    layers = [set(re.findall(r"\w+", layer)) for layer in _contract("layers")["layers"]]
    (first,) = (number for number, layer in enumerate(layers) if highest in layer)
    return set().union(*layers[first:])

"""The script that draws machines in space: it is built with the page of the studio, from the same sources."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any, cast

from steptwin.errors import Misuse
from steptwin.extras import missing
from steptwin.files.scene.recordedscene import Machine
from steptwin.jsonvalues import to_json

NO_SCRIPT = "the script that draws machines in space has not been built: 'make page' in the clone builds it; a wheel contains it"


def scene_script() -> str | None:
    """Its text, for a page; None where it has not been built."""
    script = files("steptwin.files.export") / "page" / "scene.js"
    return script.read_text("utf-8") if script.is_file() else None


class SceneScript:
    """The script in an engine for JavaScript, which has neither files nor a network. Raises `Misuse` where either is missing."""

    def __init__(self) -> None:
        try:
            import quickjs
        except ImportError:
            raise missing("drawing a machine", "scene") from None
        text = scene_script()
        if text is None:
            raise Misuse(NO_SCRIPT)
        self._context = quickjs.Context()
        self._context.eval(text)

    def call(self, function: str, *arguments: object) -> Any:
        """A function of the script (``studio-web/src/outside/main.ts``)."""
        self._context.set("given", json.dumps(arguments))
        return json.loads(cast("str", self._context.eval(f"JSON.stringify(steptwinScene.{function}(...JSON.parse(given)))")))

    def wanted(self, machine: Machine) -> Mapping[str, list[str]]:
        """Names of the ``signals`` and ``levels`` that a picture shows."""
        return self.call("wanted", to_json(machine))

"""Files of models beside the description of a world."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from steptwin.errors import Misuse
from steptwin.files.loader import is_recording
from steptwin.messages import NONE, Message
from steptwin.studio.modelfiles import LARGEST, MODEL_TOO_LARGE, check_model
from steptwin.subject.contract import Description
from steptwin.system import reason

NO_SUCH_MODEL = Message("live.no-such-model", "no body has the model {name!r}; there are {names}")
MODEL_IS_ELSEWHERE = Message("live.model-is-elsewhere", "{name}: a model lies in the folder of the description or below it")
MODEL_CANNOT_BE_READ = Message("live.model-cannot-be-read", "cannot read {name}: {why}")


class FolderModels:
    """See `steptwin.studio.modelfiles.ModelFiles`. ``names``: those that bodies have; they are relative to ``folder``."""

    def __init__(self, folder: Path, names: Iterable[str]) -> None:
        self._folder = folder.resolve()
        self._names = frozenset(names)

    async def file(self, name: str) -> str:
        if name not in self._names:
            raise Misuse(NO_SUCH_MODEL(name=name, names=sorted(self._names) or NONE()))
        path = (self._folder / name).resolve()
        if not path.is_relative_to(self._folder):
            raise Misuse(MODEL_IS_ELSEWHERE(name=name))
        try:
            if (size := path.stat().st_size) > LARGEST:
                raise Misuse(MODEL_TOO_LARGE(name=name, most=LARGEST, size=size))
            check_model(name, path.read_bytes())
        except OSError as error:
            raise Misuse(MODEL_CANNOT_BE_READ(name=name, why=reason(error))) from None
        return str(path)


def models_of(machine: Description, path: Path | None) -> FolderModels | None:
    """Models that bodies have, beside their description; None for a recording, whose description is in no file."""
    names = [body.model for body in machine.scene.bodies if body.model is not None]
    return None if path is None or is_recording(path) else FolderModels(path.parent, names)

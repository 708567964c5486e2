"""Common part of all worlds of one description: its values, the contents of its files, and the programs read from them.
Nothing of it changes, so that any number of worlds may share it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

from steptwin.diagnostics import Diagnostic, Severity, SourceText, in_order, render
from steptwin.errors import Misuse, SourceErrors
from steptwin.simulation.components.buildmemo import BuildMemo
from steptwin.simulation.describe.includes import beside
from steptwin.simulation.describe.spec import WorldSpec
from steptwin.simulation.kinds.kind import ControllerSpec
from steptwin.simulation.kinds.links import LineSpec

FileContents: TypeAlias = Mapping[str, bytes]
"""Contents of the files a description names, and of non-volatile memories (`memory_file`)."""


def memory_file(name: str) -> str:
    """The name, among the files of a world, of the initial non-volatile memory of a controller."""
    return f"state:{name}"


class _FileErrors(SourceErrors):
    """The file of this name has errors."""

    def __init__(self, file: str, text: str) -> None:
        super().__init__(text)
        self.file = file


class Blueprint:
    """A description with its files, from which worlds are built. Errors in files are reported in the text of the description."""

    def __init__(self, spec: WorldSpec, files: FileContents) -> None:
        self.spec = spec
        self.files = files
        self._findings: dict[str, tuple[SourceText, list[Diagnostic]]] = {}
        """About the files that the description names, by name."""
        self.makers: dict[str, Callable[[bytes | None], Any]] = {}
        """Make the controller of each controller whose files have no errors, as `ControllerKind.build`."""
        self.connected: Sequence[Sequence[str]] | None = None
        """Groups that share a scheduler, by name (`connected_names`), once a world was built."""
        self.memo = BuildMemo()
        for controller in spec.controllers:
            spec.text.unless_wrong(controller.path, partial(self._prepare, controller))

    def with_seed(self, seed: int) -> Blueprint:
        """The same description with another seed; what worlds keep in it does not depend on that."""
        other = copy(self)
        other.spec = replace(self.spec, seed=seed)
        return other

    @property
    def findings(self) -> Sequence[tuple[SourceText, Sequence[Diagnostic]]]:
        """Findings in each file that controllers name, in the order of its text; of a controller, up to the first file with
        errors."""
        return [(source, in_order(found)) for source, found in self._findings.values()]

    @property
    def warnings(self) -> Sequence[str]:
        """About the files that the description names."""
        found = [(source, [one for one in of if one.severity is Severity.WARNING]) for source, of in self.findings]
        return [render(source, warnings) for source, warnings in found if warnings]

    def _prepare(self, controller: ControllerSpec) -> None:
        try:
            self.makers[controller.name] = controller.kind.build(controller, self)
        except _FileErrors as error:
            keys = [key for name, key in controller.kind.files(controller) if name == error.file]
            self.spec.text.wrong_file((*controller.path, *keys[:1]), error)

    @property
    def lines(self) -> Sequence[LineSpec]:
        """As `BuildContext.lines`."""
        return self.spec.lines

    def data(self, name: str) -> bytes:
        """As `BuildContext.data`."""
        found = self.files.get(name)
        if found is None:
            raise Misuse(f"the content of the file {name!r} is not given with the description")
        return found

    def accept(self, source: SourceText, findings: Iterable[Diagnostic]) -> None:
        """As `BuildContext.accept`."""
        shown = SourceText(beside(self.spec.text.source.name, source.name), source.text)
        found = tuple(findings)
        _, known = self._findings.setdefault(source.name, (shown, []))
        known += [one for one in found if one not in known]
        if errors := [one for one in found if one.severity is Severity.ERROR]:
            raise _FileErrors(source.name, render(shown, errors))

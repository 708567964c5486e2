"""The languages of the editor server."""

from __future__ import annotations

import pytest

from steptwin.errors import Misuse
from steptwin.lsp.languages import LANGUAGES, register
from steptwin.lsp.wbc.language import WBC_PROGRAMS, WbcPrograms


class Other(WbcPrograms):
    def __init__(self, name: str, suffix: str) -> None:
        self.name = name
        self.suffix = suffix


@pytest.mark.parametrize("other", [Other("another", WBC_PROGRAMS.suffix), Other(WBC_PROGRAMS.name, ".another")])
def test_each_has_a_name_and_a_suffix_of_its_own(other: Other) -> None:
    before = dict(LANGUAGES)
    with pytest.raises(Misuse, match=rf"{WBC_PROGRAMS.name} has this name or {WBC_PROGRAMS.suffix} already"):
        register(other)
    assert before == LANGUAGES

"""The languages of the editor server."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from steptwin.errors import Misuse
from steptwin.lsp.languages import LANGUAGES, register


@pytest.mark.parametrize("other", [{"name": "another"}, {"suffix": ".another"}])
def test_each_has_a_name_and_a_suffix_of_its_own(other: dict[str, Any]) -> None:
    first = next(iter(LANGUAGES.values()))
    with pytest.raises(Misuse, match=rf"{first.name} has this name or {first.suffix} already"):
        register(replace(first, **other))

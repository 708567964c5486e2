"""What `steptwin serve mic488` makes of its options."""

from __future__ import annotations

from pathlib import Path

import pytest

from steptwin.mic488.config import ConfigError
from steptwin.runtime.serve_mic488 import load_config

MISSPELT = "[Axis0]\nHomeMod=1\nGear=3\n"


def test_what_is_doubtful_in_a_configuration_is_told_and_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "machine.cfg"
    path.write_text(MISSPELT)
    assert load_config(path, "1.70").axes[0].gear == 3.0
    assert "machine.cfg:2:1: warning C005: [Axis0] HomeMod is not known; did you mean HomeMode?" in capsys.readouterr().err


def test_what_is_wrong_is_told_with_what_is_doubtful(tmp_path: Path) -> None:
    path = tmp_path / "machine.cfg"
    path.write_text(MISSPELT + "Acc=0\n")
    with pytest.raises(ConfigError, match=r"(?s)C005: \[Axis0\] HomeMod .*C008: \[Axis0\] Acc = 0 is not permitted"):
        load_config(path, "1.70")

"""What each command of a subject needs (`steptwin.subject.commands`): one row each, complete."""

from __future__ import annotations

from collections.abc import Mapping

from steptwin.access.roles import ACT, LOOK, SERVICE, Permit
from steptwin.subject.commands import COMMANDS
from steptwin.tables import complete

PERMITS: Mapping[str, Permit] = complete(
    "command",
    COMMANDS,
    "permit",
    {
        "describe": LOOK,
        "read": LOOK,
        "pins": LOOK,
        "state": LOOK,
        "encoders": LOOK,
        "faults": LOOK,
        "fault_kinds": LOOK,
        "time": LOOK,
        "end_points": LOOK,
        "follow": LOOK,
        "unfollow": LOOK,
        "stop": LOOK,
        "set": ACT,
        "press": ACT,
        "release": ACT,
        "write": ACT,
        "turn": ACT,
        "couple": ACT,
        "see": ACT,
        "enable": ACT,
        "move": ACT,
        "home": ACT,
        "jog": ACT,
        "program": ACT,
        "download": SERVICE,
        "note": ACT,
        "expect": ACT,
        "pause": ACT,
        "resume": ACT,
        "step": ACT,
        "send": SERVICE,
        "request": SERVICE,
        "power_cycle": SERVICE,
        "fault": SERVICE,
        "clear_fault": SERVICE,
        "save": SERVICE,
        "snapshot": ACT,
        "snapshots": LOOK,
        "restore": ACT,
        "drop_snapshot": ACT,
    },
)

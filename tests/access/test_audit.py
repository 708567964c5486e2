"""Who did what."""

from __future__ import annotations

from steptwin.access.audit import Audit
from steptwin.access.control import Viewer
from steptwin.access.roles import Role
from steptwin.jsonvalues import to_json


def test_of_long_fields_the_long_values_are_left_out() -> None:
    audit = Audit(lambda: "2026-01-01T00:00:00.000+00:00")
    audit.add(Viewer(1, "anna", Role.ENGINEER), 5, "download", {"controller": "table", "text": "END\n" * 300}, "done")
    assert to_json(audit.last(1)[0])["fields"] == {"controller": "table", "text": "(1200 characters)"}

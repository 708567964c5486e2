"""Pieces of schemas that requests and messages share."""

from __future__ import annotations

from steptwin.subject.fields import Schema

MOMENT: Schema = {"type": "string", "pattern": "^[0-9]{1,20}$", "description": "Virtual time, as decimal text [ns]"}

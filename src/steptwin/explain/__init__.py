"""Explanation of what a program does, as far as its text shows: computed from its control flow, without running it.

`steptwin.explain.mic488.explain` and `steptwin.explain.m1486.explain` give an `Explanation`; `steptwin.explain.text.text`,
`steptwin.explain.jsondata.to_json` and `steptwin.explain.picture.picture` show it.
"""

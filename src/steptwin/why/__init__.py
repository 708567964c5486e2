"""Why something in a world is as it is: the chain of causes, from the present back.

`steptwin.why.question` answers a question: `steptwin.why.values` finds since when it is so, `steptwin.why.resting` what has left
what has not changed, `steptwin.why.presentstates` on what that depends, `steptwin.why.whynot` what a condition lacks.
`steptwin.why.notedpast` is the past that these are about: `steptwin.why.log` runs it again and notes what can be a cause,
`steptwin.why.lacking` has what was before that and decides, `steptwin.why.replayed` remembers what is in no trace.
`steptwin.why.causes` follows the causes of a change, with those of `steptwin.why.axes`, `steptwin.why.attempts`,
`steptwin.why.elements`, `steptwin.why.holding`, `steptwin.why.workpieces`, `steptwin.why.controllers`, `steptwin.why.programs`,
`steptwin.why.interrupts` and `steptwin.why.scripts`, by the names of signals with `steptwin.why.changes`;
`steptwin.why.answer` has the result; `steptwin.why.pastquestions` asks about a past that is kept in states and inputs, as that
of a running world, and tries it without faults and actions with `steptwin.why.without`.
"""

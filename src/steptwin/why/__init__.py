"""Why something in a world is as it is: the chain of causes, from the present back.

`steptwin.why.log` runs the past of a world again and notes what can be a cause; `steptwin.why.lacking` has what was before that
and decides; `steptwin.why.replayed` remembers what is in no trace; `steptwin.why.question` finds the last change of what is asked
for; `steptwin.why.causes` follows the causes of a change, with those of `steptwin.why.axes`, `steptwin.why.elements`,
`steptwin.why.controllers` and `steptwin.why.programs`; `steptwin.why.answer` has the result; `steptwin.why.pastquestions` asks
about a past that is kept in states and inputs, as that of a running world.
"""

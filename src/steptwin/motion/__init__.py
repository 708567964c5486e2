"""Pure mathematics of motion: profiles, planning, pulses.

Units: positions in pulses, velocities in pulses/s, accelerations in pulses/s², moments in whole nanoseconds (`Nanos`),
durations inside a profile in seconds.
"""

from steptwin.motion.planner import MotionState, plan_position, plan_stop, plan_velocity
from steptwin.motion.profile import Profile, Segment, at_rest

__all__ = ["MotionState", "Profile", "Segment", "at_rest", "plan_position", "plan_stop", "plan_velocity"]

"""Trajectories of axes, motors, loads, belts and cams, in closed form. Sees the scheduler."""

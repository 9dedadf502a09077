"""The pure core: geometry, kinematics, tasks, limits and laws. No I/O, no clock, no threads."""

"""`pneuarm learn`: repeats a trajectory, and keeps that with which it is followed best."""

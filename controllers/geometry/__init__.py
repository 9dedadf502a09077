"""Rigid transforms, rotations, and CasADi functions called fast."""

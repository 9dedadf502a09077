"""Constant-curvature kinematics: the paper's serial chain and the singularity-free form."""

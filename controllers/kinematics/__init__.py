"""Constant-curvature kinematics: the paper's serial chain and the singularity-free form.

The paper's Eq. (1), (2) and (3) stand in `serial_chain.py`, as they are printed. What runs is
`compiled.py`, the pose and its derivative in the form that `constant_curvature.py` explains.
"""

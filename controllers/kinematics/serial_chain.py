"""The paper's equations (1), (2) and (3) as it writes them: the reference, not what runs.

The parameters ``(phi, theta, r)`` have no meaning for the straight arm (r is infinite), so the
controllers use :mod:`controllers.kinematics.constant_curvature` and the tests compare the two.
"""

import numpy as np

from controllers.arm import Array
from controllers.errors import InvalidInput


def _checked(theta_rad: float, radius_m: float) -> None:
    if not radius_m > 0.0:
        raise InvalidInput(f"radius_m = {radius_m:g}: the radius of curvature must be above 0")
    if not np.isfinite(theta_rad):
        raise InvalidInput(f"theta_rad = {theta_rad:g}: the bending angle must be finite")


def paper_transform(phi_rad: float, theta_rad: float, radius_m: float) -> Array:
    """Transform (4, 4) from the paper's tip frame to the base, Eq. (1)."""
    _checked(theta_rad, radius_m)
    cp, sp = np.cos(phi_rad), np.sin(phi_rad)
    ct, st = np.cos(theta_rad), np.sin(theta_rad)
    return np.array(
        [
            [cp * ct, -sp, cp * st, radius_m * cp * (1.0 - ct)],
            [sp * ct, cp, sp * st, radius_m * sp * (1.0 - ct)],
            [-st, 0.0, ct, radius_m * st],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def velocity_jacobian(phi_rad: float, theta_rad: float, radius_m: float) -> Array:
    """Jacobian (6, 3) of the tip twist over ``(phi, theta, r)`` rates, Eq. (2).

    The paper prints the second and third column as the derivative along theta and r.
    """
    _checked(theta_rad, radius_m)
    cp, sp = np.cos(phi_rad), np.sin(phi_rad)
    ct, st = np.cos(theta_rad), np.sin(theta_rad)
    return np.array(
        [
            [-radius_m * sp * (1.0 - ct), radius_m * cp * st, cp * (1.0 - ct)],
            [radius_m * cp * (1.0 - ct), radius_m * sp * st, sp * (1.0 - ct)],
            [0.0, radius_m * ct, st],
            [0.0, -sp, 0.0],
            [0.0, cp, 0.0],
            [1.0, 0.0, 0.0],
        ]
    )


def serial_jacobian(phi_rad: float, theta_rad: float, radius_m: float) -> Array:
    """Jacobian (6, 3) from the axes and origins of the four-joint chain, Eq. (3).

    Joints 2 and 4 are prismatic and coupled: their columns add up.
    """
    transform = paper_transform(phi_rad, theta_rad, radius_m)
    z1 = np.array([0.0, 0.0, 1.0])
    z2 = np.array([np.cos(phi_rad), np.sin(phi_rad), 0.0])
    z3 = np.array([-np.sin(phi_rad), np.cos(phi_rad), 0.0])
    z4 = -transform[:3, 0]
    o3, o5 = radius_m * z2, transform[:3, 3]
    linear = np.column_stack([np.cross(z1, o5), np.cross(z3, o5 - o3), z2 + z4])
    angular = np.column_stack([z1, z3, np.zeros(3)])
    return np.vstack([linear, angular])

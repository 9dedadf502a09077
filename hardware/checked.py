"""What every adapter refuses of a command before anything is sent."""

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import HardwareError


def checked_command(pressures_pa: Array, low_pa: Array, high_pa: Array, name: str) -> Array:
    """Return a command inside the range; raises HardwareError for one that is no set of numbers."""
    if pressures_pa.shape != low_pa.shape or not np.isfinite(pressures_pa).all():
        raise HardwareError(
            f"pressures_pa = {pressures_pa.tolist()}: {name} takes finite numbers of shape "
            f"{low_pa.shape}"
        )
    return np.minimum(np.maximum(pressures_pa, low_pa), high_pa)

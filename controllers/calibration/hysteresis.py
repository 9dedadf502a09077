"""The play (backlash) that stands for a chamber's hysteresis, over a whole recording, and back.

A play of half width w holds its output until the input has pushed it: the output is the last one
clipped to ``input - w .. input + w``.
"""

import numpy as np

from controllers.arm import Array


def play_outputs(pressures_pa: Array, half_width_pa: Array) -> tuple[Array, Array]:
    """Output of the play, and its derivative over the half width, at every sample.

    ``pressures_pa`` (samples, n_sections, 3) is the whole history from an arm that was vented,
    ``half_width_pa`` (n_sections, 1) or alike. Both results have the shape of the pressures.
    """
    outputs, slopes = np.zeros_like(pressures_pa), np.zeros_like(pressures_pa)
    last, slope = np.zeros(pressures_pa.shape[1:]), np.zeros(pressures_pa.shape[1:])
    for index, pressures in enumerate(pressures_pa):
        low, high = pressures - half_width_pa, pressures + half_width_pa
        slope = np.where(last < low, -1.0, np.where(last > high, 1.0, slope))
        last = np.minimum(np.maximum(last, low), high)
        outputs[index], slopes[index] = last, slope
    return outputs, slopes

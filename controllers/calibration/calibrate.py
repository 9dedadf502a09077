"""The whole calibration of a recording: rests, map, response."""

from dataclasses import dataclass, replace

from controllers.arm import Arm
from controllers.calibration.excitation import require_determined, require_motion
from controllers.calibration.fit import Fit, fit
from controllers.calibration.recording import Recording, find_rests
from controllers.calibration.response import ResponseFit, fit_response
from controllers.errors import CalibrationError


@dataclass(frozen=True)
class Calibration:
    """``arm`` with everything that was fitted in place, and where it comes from.

    ``response`` is None where the recording has no step; ``note`` then says so.
    """

    before: Arm
    arm: Arm
    fit: Fit
    response: ResponseFit | None
    note: str = ""


def calibrate(arm: Arm, recording: Recording, in_world: bool = False) -> Calibration:
    """Fit ``arm`` to a recording; ``in_world`` as in :func:`controllers.calibration.fit.fit`.

    Raises CalibrationError where the recording does not show what the map needs.
    """
    rests = find_rests(recording)
    require_motion(arm, recording, rests)
    found = fit(arm, recording, rests, in_world)
    require_determined(found)
    try:
        response = fit_response(found.arm, recording, found.frames)
    except CalibrationError as error:
        return Calibration(arm, found.arm, found, None, f"the response is kept: {error}")
    fitted = replace(found.arm, response=response.response)
    return Calibration(arm, fitted, found, response)

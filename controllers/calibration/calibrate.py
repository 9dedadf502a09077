"""The whole calibration of a recording: rests, map, response."""

from dataclasses import dataclass, replace

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.excitation import require_determined, require_motion
from pneuarm.controllers.calibration.fit import Fit, fit
from pneuarm.controllers.calibration.recording import Recording, find_rests
from pneuarm.controllers.calibration.response import ResponseFit, fit_response


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
    """Fit ``arm`` to a recording; ``in_world`` as in :func:`.fit.fit`.

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

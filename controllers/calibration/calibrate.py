"""The whole calibration of a recording: rests, map, response."""

from dataclasses import dataclass, replace

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import CalibrationError, InvalidInput
from pneuarm.controllers.calibration.excitation import require_determined, require_motion
from pneuarm.controllers.calibration.fit import Fit, fit
from pneuarm.controllers.calibration.recording import Recording, find_rests
from pneuarm.controllers.calibration.response import ResponseFit, fit_response, fit_valves
from pneuarm.controllers.calibration.worth import explained, require_worth


@dataclass(frozen=True)
class Calibration:
    """``arm`` with everything that was fitted in place, and where it comes from.

    ``response`` is None where the recording has no step; ``note`` then says so, and names what of
    a response was not identified.
    """

    before: Arm
    arm: Arm
    fit: Fit
    response: ResponseFit | None
    note: str = ""


def calibrate(arm: Arm, recording: Recording, in_world: bool = False) -> Calibration:
    """Fit ``arm`` to a recording; ``in_world`` as in :func:`.fit.fit`.

    Raises CalibrationError where the recording does not show what the map needs, and where the map
    does not explain the recording.
    """
    valves = fit_valves(recording, arm.response)
    behind = replace(arm.response, delay_s=valves.delay_s, lag_s=valves.lag_s)
    rests = find_rests(recording, behind)
    require_motion(arm, recording, rests)
    lagging = replace(arm, response=behind)
    try:
        found = fit(lagging, recording, rests, in_world)
    except InvalidInput as error:
        raise CalibrationError(
            f"what fits the measured tips best is no arm: {error}; "
            f"{explained(lagging, recording, rests, in_world)}"
        ) from error
    require_worth(found, lagging, recording, rests)
    require_determined(found)
    kept = replace(found.arm, response=arm.response)
    try:
        response = fit_response(kept, recording, found.frames, valves)
    except CalibrationError as error:
        return Calibration(arm, kept, found, None, f"the response is kept: {error}")
    fitted = replace(kept, response=response.response)
    return Calibration(arm, fitted, found, response, "; ".join(response.not_identified))

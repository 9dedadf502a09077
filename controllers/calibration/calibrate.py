"""The whole calibration of a recording: rests, map, response."""

from dataclasses import dataclass, replace

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import CalibrationError, InvalidInput
from pneuarm.controllers.calibration.excitation import require_determined, require_motion
from pneuarm.controllers.calibration.fit import Fit, fit
from pneuarm.controllers.calibration.recording import Recording, find_rests
from pneuarm.controllers.calibration.response import ResponseFit, fit_response
from pneuarm.controllers.calibration.valve_fit import fit_valves
from pneuarm.controllers.calibration.worth import explained, require_worth


@dataclass(frozen=True)
class Calibration:
    """``arm`` with everything that was fitted in place, and where it comes from.

    ``note`` names what of the response was not identified.
    """

    before: Arm
    arm: Arm
    fit: Fit
    response: ResponseFit
    note: str = ""


def calibrate(arm: Arm, recording: Recording, in_world: bool = False) -> Calibration:
    """Fit ``arm`` to a recording; ``in_world`` as in :func:`.fit.fit`.

    Raises CalibrationError where the recording does not show what the map needs, and where the map
    does not explain the recording.
    """
    valves = fit_valves(recording, arm.response)
    rests = find_rests(recording, valves.response)
    require_motion(arm, recording, rests)
    lagging = replace(arm, response=valves.response)
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
    response = fit_response(kept, recording, found.frames, valves)
    fitted = replace(kept, response=response.response)
    return Calibration(arm, fitted, found, response, "; ".join(response.not_identified))

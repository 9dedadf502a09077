"""What a calibration moves an arm through: gentle steps, then the plan at the pace they allow.

The monitors of the daemon stay as they are. They expect the response of the configuration, which
nobody may have measured: until it is known what the valves do, no pressure moves by what would be
a fault; from then on the arm moves as `controllers/calibration/pace.py` says, and a ramp waits
wherever a chamber turns out to be slower than the gentle steps showed.
"""

import numpy as np

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import CalibrationError
from pneuarm.controllers.calibration.excitation import place
from pneuarm.controllers.calibration.pace import Pace, pace_of
from pneuarm.controllers.calibration.plan import LONGEST_REST_S, Move, gentle
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.calibration.valve_fit import fit_valves
from pneuarm.hardware.tables.table import BAR
from pneuarm.service.configuration.configuration import Configuration
from pneuarm.service.monitors.monitors import Lag
from pneuarm.service.monitors.pressure_deviates import PressureDeviates, PressureDeviatesKeys
from pneuarm.service.monitors.sensor_frozen import SensorFrozen, SensorFrozenKeys

#: Of what would be a fault, in a second: as fast as a ramp may be while nothing is known.
_UNKNOWN_PER_S = 0.2
#: Of what would be a fault, how far a pressure may be from the expected one in a ramp.
_WAITS_SHARE = 0.7
#: A chamber that goes less than this share of the way that it is sent does not follow.
_FOLLOWED_SHARE = 0.5


def _keys(configuration: Configuration) -> tuple[PressureDeviatesKeys, SensorFrozenKeys]:
    """Return what the two monitors were told that may end a motion of slow valves."""
    deviates, frozen = (
        getattr(configuration.monitors, kind.fault.code)
        for kind in (PressureDeviates, SensorFrozen)
    )
    return deviates, frozen


def first_moves(configuration: Configuration) -> tuple[list[Move], Pace]:
    """Return the gentle steps, and the pace at which one of them may be approached again."""
    deviates, frozen = _keys(configuration)
    fault_pa = min(deviates.deviation_bar, frozen.moved_bar) * BAR
    slowly = Pace(_UNKNOWN_PER_S * fault_pa, _UNKNOWN_PER_S * fault_pa)
    return gentle(configuration.build_arm(), fault_pa), slowly


def pace_after(configuration: Configuration, recording: Recording) -> Pace:
    """Return at what pace the arm may move whose gentle steps were recorded.

    Raises CalibrationError for a chamber that does not follow.
    """
    arm = configuration.build_arm()
    _require_following(arm, recording)
    valves = fit_valves(recording, arm.response)
    return pace_of(arm.response, valves.response, _keys(configuration)[0].deviation_bar * BAR)


def _require_following(arm: Arm, recording: Recording) -> None:
    sent_pa, measured_pa = np.ptp(recording.sent_pa, axis=0), np.ptp(recording.measured_pa, axis=0)
    for section, chamber in np.argwhere(measured_pa < _FOLLOWED_SHARE * sent_pa):
        at = (section, chamber)
        raise CalibrationError(
            f"{place(arm, *at)} was sent {sent_pa[at] / BAR:.2f} bar in small steps, and moved by "
            f"{measured_pa[at] / BAR:.2f} bar: look at its valve and its tube before it is "
            "calibrated"
        )


class Pacer:
    """The time of a move, which stands while a pressure is nearly too far from the expected one.

    It sees what the monitor of the pressures sees, and stays within what that allows.
    """

    def __init__(self, configuration: Configuration) -> None:
        self._lag = Lag(configuration.build_arm().response)
        self._far_pa = _WAITS_SHARE * _keys(configuration)[0].deviation_bar * BAR
        self._seen_s: float | None = None
        self._far = False
        self._ramp_s = self._waited_s = self.elapsed_s = 0.0

    def begin(self, move: Move) -> None:
        """Begin a move."""
        self._ramp_s, self._waited_s, self.elapsed_s = move.ramp_s, 0.0, 0.0

    def see(self, time_s: float, sent_pa: list[float], measured_pa: list[float]) -> None:
        """Take what was sent to the chambers, and what they had, at a time."""
        passed_s = 0.0 if self._seen_s is None else max(0.0, time_s - self._seen_s)
        self._seen_s = time_s
        expected = self._lag.advance(sent_pa, measured_pa, passed_s)
        pairs = zip(measured_pa, expected, strict=True)
        self._far = any(abs(measured - value) > self._far_pa for measured, value in pairs)

    def go_on(self, seconds: float) -> None:
        """Let time pass: for the move, or, in a ramp that must wait, for nothing, but not for ever.

        A chamber that never comes nearer is for the monitor to see.
        """
        if self._far and self.elapsed_s < self._ramp_s and self._waited_s < LONGEST_REST_S:
            self._waited_s += seconds
        else:
            self.elapsed_s += seconds

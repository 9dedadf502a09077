"""From the pressures that shall act to the setpoints that make them act: lead, dither, hysteresis.

Pressures are gauge, in Pa, arrays of (n_sections, 3).
"""

import math

import numpy as np

from pneuarm.controllers.actuation.dither import Dither
from pneuarm.controllers.actuation.valve_lead import ValveLead
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.feedback.observer import FeedbackSettings
from pneuarm.controllers.geometry.moving_point import MovingPoint

#: The dither grows from nothing, and a share of the hysteresis or the lead from 0 to 1, in this
#: time (s).
_RAMP_S = 0.3

#: A reference as fast as this (m/s) moves the arm through its hysteresis by itself.
_MOVING_M_S = 0.06


class Setpoints:
    """Setpoints of an active arm, tick by tick, and what a hold keeps.

    ``hysteresis_share`` is how much of the calibrated hysteresis is to be inverted now. ``held_pa``
    is what the chambers have or are about to have, without any lead.
    """

    def __init__(self, arm: Arm, feedback: FeedbackSettings, valves: ValveLead) -> None:
        self._feedback, self._valves = feedback, valves
        self._dither = Dither(feedback.dither_pa, feedback.dither_period_s)
        self._low_pa = arm.per_chamber("pressure_min_pa")
        self._high_pa = arm.per_chamber("pressure_max_pa")
        self.held_pa = np.zeros((arm.n_sections, 3))
        self.hysteresis_share = self._lead_share = 1.0
        self._dither_since_s: float | None = None

    def start(self, measured_pa: Array | None) -> None:
        """Begin anew at measured pressures, within the limits; None goes on from those held.

        The whole hysteresis is inverted from here on: a share that went up only afterwards would
        move an arm to which nobody has said anything yet.
        """
        if measured_pa is not None:
            self.held_pa = np.clip(measured_pa, self._low_pa, self._high_pa)
        self.hysteresis_share = 1.0
        self._valves.forget()

    def step(
        self,
        wanted_pa: Array,
        dt_s: float,
        now_s: float,
        asked_for: bool,
        reference: MovingPoint | None,
        corrected: bool,
    ) -> Array:
        """Return the setpoints for wanted pressures, inside the limits, and keep those for a hold.

        Pressures that are ``asked_for`` are sent as they are: a lead that overshoots in the end
        would cross the play that a calibration wants to see. ``corrected`` is whether the tip is
        measured and used. What is wanted outside of the limits, or is no number, is passed on as it
        is: it is for the guard to see and to count.
        """
        self._lead_share = _toward(0.0 if asked_for else 1.0, self._lead_share, dt_s)
        led_pa = self._valves.sent_pa(wanted_pa, dt_s, self._lead_share)
        setpoints_pa = led_pa + self._dither_pa(now_s, dt_s, reference, corrected)
        within_pa = np.minimum(np.maximum(wanted_pa, self._low_pa), self._high_pa)
        if not (within_pa == wanted_pa).all():  # never true of a NaN
            return wanted_pa
        self.held_pa = wanted_pa
        return np.minimum(np.maximum(setpoints_pa, self._low_pa), self._high_pa)

    def _dither_pa(
        self, now_s: float, dt_s: float, reference: MovingPoint | None, corrected: bool
    ) -> float:
        """What is added to every setpoint.

        Only a reference that is followed with the tip measured needs it; a camera lost on the way
        changes nothing.
        """
        if reference is None:
            self._dither_since_s = None
            self.hysteresis_share = _toward(1.0, self.hysteresis_share, dt_s)
            return 0.0
        if self._dither_since_s is None:
            if not corrected:
                return 0.0
            self._dither_since_s = now_s
        self.hysteresis_share = _toward(self._share_at(reference), self.hysteresis_share, dt_s)
        return min(1.0, (now_s - self._dither_since_s) / _RAMP_S) * self._dither.at_pa(now_s)

    def _share_at(self, reference: MovingPoint) -> float:
        """How much of the hysteresis to invert at the speed of the reference."""
        speed_m_s = math.hypot(*reference.velocity[:3])
        at_rest = self._feedback.hysteresis_share
        moving = self._feedback.hysteresis_share_moving
        return at_rest + min(1.0, speed_m_s / _MOVING_M_S) * (moving - at_rest)


def _toward(wanted: float, share: float, dt_s: float) -> float:
    """Return a share that goes to what is wanted, all the way within ``_RAMP_S``."""
    largest = dt_s / _RAMP_S
    return share + min(max(wanted - share, -largest), largest)

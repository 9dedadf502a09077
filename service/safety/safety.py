"""What the loop asks about safety: the monitors, the faults they find, and the ramp down."""

import math

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.tables.table import BAR
from pneuarm.service.configuration.tables.monitors import MonitorsConfig
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import ModeKeeper
from pneuarm.service.monitors.measurement_age import DeviceLost
from pneuarm.service.monitors.model_contradicted import TipModel
from pneuarm.service.monitors.monitors import Monitors
from pneuarm.service.processes.pipe import SetTipPose
from pneuarm.service.safety.fault_keeper import FaultKeeper
from pneuarm.service.safety.faults import TICK_FAILED


class Ramp:
    """All pressures to zero in proportion, none faster than a rate; over after a fixed time.

    In proportion, so that the arm straightens the way it is bent. Only time moves it: whatever the
    device answers, it ends.
    """

    def __init__(self, start_pa: Array, rate_pa_s: float, now_s: float) -> None:
        self._start_pa = np.where(np.isfinite(start_pa), start_pa, 0.0)
        self._begin_s = now_s
        self._duration_s = float(np.abs(self._start_pa).max()) / rate_pa_s

    def over(self, now_s: float) -> bool:
        """Whether zero is reached."""
        return now_s - self._begin_s >= self._duration_s

    def pressures_pa(self, now_s: float) -> Array:
        """Pressures (n_sections, 3) wanted at a time before the end."""
        return self._start_pa * (1.0 - (now_s - self._begin_s) / self._duration_s)


class Safety:
    """Lets the monitors look once a tick, and their faults change the mode."""

    def __init__(self, arm: Arm, config: MonitorsConfig, keeper: ModeKeeper) -> None:
        self._keeper = keeper
        self._faults = FaultKeeper(keeper)
        self._monitors = Monitors(arm, config.keys_of_monitors())
        self._tip_model = TipModel(arm)
        slowest = float(arm.per_chamber("pressure_slew_max_pa_s").min())
        self._ramp_pa_s = min(config.ramp_bar_s * BAR, slowest)
        self._ramp: Ramp | None = None

    @property
    def bits(self) -> int:
        """The active faults as bits on the wire."""
        return self._faults.bits

    def look(
        self,
        measurement: Measurement,
        sent_pa: Array,
        estimated_m: Array,
        tip_pose: SetTipPose | None,
        overruns: int,
        now_ns: int,
        dt_s: float,
    ) -> None:
        """Look at this tick's measurement, and at what was sent and estimated in the one before."""
        now_s, before = now_ns * 1e-9, self._keeper.mode
        tip_error_m = math.nan
        if tip_pose is not None:
            tip_error_m = self._tip_model.error_m(
                tip_pose.position_m, tip_pose.received_ns, measurement.pressures_pa, now_ns
            )
        found = self._monitors.look(
            measurement, sent_pa, estimated_m, tip_error_m, before, now_s, dt_s, overruns
        )
        self._faults.seen(found, now_s)
        if self._keeper.mode != Mode.FAULT or self._faults.vents():
            self._ramp = None
        elif before != Mode.FAULT and self._faults.ramps():
            self._ramp = Ramp(sent_pa, self._ramp_pa_s, now_s)

    def failed(self, error: Exception, cause: str, now_s: float) -> None:
        """Latch the fault of a call or a tick that failed; the loop has vented already."""
        lost = isinstance(error, HardwareError | OSError)
        self._ramp = None
        self._faults.failed(DeviceLost.fault if lost else TICK_FAILED, cause, now_s)

    def worked(self) -> None:
        """A whole tick went through."""
        self._faults.worked()

    def ramping_pa(self, now_s: float) -> Array | None:
        """Pressures (n_sections, 3) on the way down after a fault; None when nothing ramps."""
        if self._ramp is None or self._keeper.mode != Mode.FAULT or self._ramp.over(now_s):
            return None
        return self._ramp.pressures_pa(now_s)

    def why_not(self, event: ModeEvent, now_s: float) -> str:
        """Say what still forbids to enable or to reset, or return an empty string."""
        if event == ModeEvent.RESET and self.ramping_pa(now_s) is not None:
            return "the pressures still ramp down; wait until they are zero"
        return self._faults.why_not(event)

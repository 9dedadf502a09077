"""What the loop asks about safety: the monitors, the faults they find, and the ramp down."""

import math

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.interface import Measurement
from pneuarm.service.configuration.monitor_settings import MonitorSettings
from pneuarm.service.modes.mode import Mode, ModeEvent
from pneuarm.service.modes.mode_keeper import ModeKeeper
from pneuarm.service.processes.pipe import SetTipPose
from pneuarm.service.safety.fault_keeper import FaultKeeper
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.tip_model import TipModel
from pneuarm.service.safety.monitors.watch import Watch
from pneuarm.service.safety.ramp import Ramp


class Safety:
    """Lets the monitors look once a tick, and their faults change the mode."""

    def __init__(self, arm: Arm, settings: MonitorSettings, keeper: ModeKeeper) -> None:
        self._keeper = keeper
        self._faults = FaultKeeper(keeper)
        self._watch = Watch(arm, settings)
        self._tip_model = TipModel(arm)
        slowest = float(arm.per_chamber("pressure_slew_max_pa_s").min())
        self._ramp_pa_s = min(settings.ramp_pa_s, slowest)
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
        found = self._watch.look(
            measurement, sent_pa, estimated_m, tip_error_m, before, now_s, dt_s, overruns
        )
        self._faults.seen(found, now_s)
        if self._keeper.mode != Mode.FAULT:
            self._ramp = None
        elif before != Mode.FAULT and self._faults.ramps():
            self._ramp = Ramp(sent_pa, self._ramp_pa_s, now_s)
        elif self._ramp is not None and (self._ramp.over(now_s) or self._faults.vents()):
            self._ramp = None

    def failed(self, error: Exception, cause: str, now_s: float) -> None:
        """Latch the fault of a call or a tick that failed; the loop has vented already."""
        lost = isinstance(error, HardwareError | OSError)
        self._ramp = None
        self._faults.failed(FaultCode.DEVICE_LOST if lost else FaultCode.TICK_FAILED, cause, now_s)

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

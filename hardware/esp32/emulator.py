"""An ESP32 controller without the controller: its JSON lines, with an emulated arm behind it.

It behaves like the firmware where a host can tell: it works in passes of 20 ms, of the commands
that came in one pass it carries out the first and forgets the others, and it begins in its control
of lengths, which fills the chambers without being asked. Nothing here reads a clock.
"""

import json

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.geometry.rotations import roll_pitch_yaw
from pneuarm.hardware.channels import Channels
from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.esp32.protocol import CEILING_PA, CHAMBERS, KPA, PASS_S
from pneuarm.hardware.transports.pseudo_terminal import SlowMotion

#: What the control of lengths raises the targets by in a pass, towards its first target, kPa.
_LENGTH_CONTROL_KPA = 0.02


class Esp32Emulator:
    """The controller's side of the port: bytes in, bytes out, at times that are given."""

    def __init__(self, arm: EmulatedArm, channels: Channels) -> None:
        self.arm, self._motion = arm, SlowMotion()
        self._channels = channels
        self.boot()

    def boot(self) -> None:
        """Start as after power came."""
        self._targets_kpa = [0.0] * CHAMBERS
        self._controls_lengths = True
        self._pass_s = -1.0
        self._rest = b""

    def take(self, received: bytes, time_s: float) -> bytes:
        """Keep what has arrived for the next pass; nothing is answered before."""
        self._rest += received
        return b""

    def advance(self, time_s: float) -> bytes:
        """Let the air move on; once a pass, carry out one command and say how things are."""
        self.arm.advance(self._motion.until(time_s))
        if time_s - self._pass_s < PASS_S:
            return b""
        self._pass_s = time_s
        answer = b""
        whole, newline, rest = self._rest.rpartition(b"\n")
        if newline:
            self._rest = rest
            answer = self._run(whole.partition(b"\n")[0])
        if self._controls_lengths:
            most = CEILING_PA / KPA
            self._targets_kpa = [min(t + _LENGTH_CONTROL_KPA, most) for t in self._targets_kpa]
        targets_pa = self._channels.gather(self._targets_kpa) * KPA
        if not np.array_equal(targets_pa, self.arm.setpoints_pa):
            self.arm.set_pressures_pa(targets_pa, time_s)
        return answer + self._feedback()

    def _run(self, line: bytes) -> bytes:
        try:
            said = json.loads(line)
            command = said["command"]
        except (ValueError, TypeError, KeyError):
            return b'{"error":"Invalid JSON command"}\r\n'
        match command:
            case "set_pressure":
                return self._set(said.get("values"))
            case "emergency_stop":  # both valves of every chamber are closed
                self._targets_kpa = self._in_channels(self.arm.pressures_pa / KPA)
                self._controls_lengths = False
                return b'{"status":"emergency_stop_activated","dance_mode":false}\r\n'
            case _:
                text = {"status": "error", "message": f"Unknown command: {command}"}
                return json.dumps(text).encode() + b"\r\n"

    def _set(self, values: object) -> bytes:
        if not isinstance(values, list) or len(values) < CHAMBERS:
            return b'{"error":"Invalid pressure values"}\r\n'
        most = CEILING_PA / KPA
        self._targets_kpa = [min(max(float(value), 0.0), most) for value in values[:CHAMBERS]]
        self._controls_lengths = False
        shown = ",".join(f"{value:.2f}" for value in self._targets_kpa)
        return f'{{"confirm":"received_pressure_control","targets":[{shown}]}}\r\n'.encode()

    def _in_channels(self, per_chamber: Array) -> list[float]:
        return self._channels.scatter(per_chamber)

    def _feedback(self) -> bytes:
        roll, pitch, yaw = np.rad2deg(roll_pitch_yaw(self.arm.tip()[1])).round(2).tolist()
        said = {"imu_roll": roll, "imu_pitch": pitch, "imu_yaw": yaw}
        lengths_mm = self._in_channels(self.arm.lengths_m * 1e3)
        for name, values in (
            ("potentiometer", lengths_mm * 2),  # two rows of three, of the same chambers
            ("pressure", self._in_channels(self.arm.pressures_pa / KPA)),
            ("target_pressure", self._targets_kpa),
        ):
            said |= {f"{name}_{index + 1}": round(value, 3) for index, value in enumerate(values)}
        return json.dumps(said, separators=(",", ":")).encode() + b"\r\n"

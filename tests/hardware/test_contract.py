"""Every adapter keeps the contract of :mod:`pneuarm.service.devices.contract`."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.hardware.ctrl_p.device import DEVICE as CTRL_P
from pneuarm.hardware.ctrl_p.protocol import STEP_PA as CTRL_P_STEP_PA
from pneuarm.hardware.esp32.device import DEVICE as ESP32
from pneuarm.hardware.esp32.protocol import PASS_S as ESP32_PASS_S
from pneuarm.hardware.esp32.protocol import STEP_PA as ESP32_STEP_PA
from pneuarm.hardware.festo.counts import COUNT_PA
from pneuarm.hardware.festo_cpx.device import DEVICE as FESTO_CPX
from pneuarm.hardware.festo_vtem.device import DEVICE as FESTO_VTEM
from pneuarm.hardware.mujoco.device import DEVICE as MUJOCO
from pneuarm.hardware.simulator.device import DEVICE as SIMULATOR
from pneuarm.logs.reading.device import DEVICE as REPLAY
from pneuarm.service.devices import registry
from pneuarm.service.devices.contract import Bench, DeviceContract
from tests.hardware.arms import ARMS
from tests.hardware.festo.festo_bench import festo_cpx, festo_vtem
from tests.logs.reading.test_replay_device import record


class TestSimulator(DeviceContract):
    """What it was told is what its pressures settle at."""

    device = SIMULATOR

    @contextmanager
    def open(self, preset: str) -> Iterator[Bench]:
        arm = ARMS[preset]
        hardware = registry.build(self.configured(preset, {}), arm)
        bench = Bench(arm, hardware, period_s=1e-3, told_tolerance_pa=2000.0)

        def told_pa() -> Array:
            bench.clock.pass_s(1.0)
            readings = [hardware.read(bench.now_s()).pressures_pa for _ in range(50)]
            return np.mean(readings, axis=0)

        bench.told_pa = told_pa
        yield bench


class TestMujoco(TestSimulator):
    """The same air, and another body."""

    device = MUJOCO


class TestReplay(DeviceContract):
    """A recorded session of the arm, 60 s long."""

    device = REPLAY

    @contextmanager
    def open(self, preset: str) -> Iterator[Bench]:
        arm = ARMS[preset]
        with TemporaryDirectory() as folder:
            log = record(Path(folder) / "log.mcap", arm, 6000)
            whole = self.configured(preset, {"log": str(log)})
            yield Bench(arm, registry.build(whole, arm))


class TestCtrlP(DeviceContract):
    """A controller with eight channels, wired from the last one down."""

    device = CTRL_P
    resolution_pa = CTRL_P_STEP_PA
    keys = {"channels": 8, "valves": [7, 6, 5], "telemetry_ms": 10}


class TestEsp32(DeviceContract):
    """A controller wired across."""

    device = ESP32
    resolution_pa = ESP32_STEP_PA
    period_s = ESP32_PASS_S
    keys = {"valves": [2, 0, 1], "connect_timeout_s": 1.0}


class TestFestoCpx(DeviceContract):
    """A terminal with a gap between its valves."""

    device = FESTO_CPX
    resolution_pa = COUNT_PA

    def open(self, preset: str):
        return festo_cpx(ARMS[preset])


class TestFestoVtem(DeviceContract):
    """A terminal with the chambers on its slots 1 and 2."""

    device = FESTO_VTEM
    resolution_pa = COUNT_PA

    def open(self, preset: str):
        return festo_vtem(ARMS[preset])

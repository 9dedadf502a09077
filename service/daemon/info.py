"""The facts of a daemon: what the `info` key answers, what the log begins with."""

import platform
from importlib.metadata import version

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.simulator.device import SimulatedDevice
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.service.configuration.configuration import Configuration

_PACKAGES = (
    "pneuarm",
    "casadi",
    "osqp",
    "eclipse-zenoh",
    "rerun-sdk",
    "mcap",
    "numpy",
    "protobuf",
)


def info_of(configuration: Configuration, arm: Arm, log_path: str) -> pb.Info:
    """Configuration, limits and versions."""
    device = configuration.device
    versions = {name: version(name) for name in _PACKAGES}
    versions["python"] = platform.python_version()
    return pb.Info(
        arm=arm.name,
        config_toml=configuration.to_toml(),
        length_min_m=arm.per_chamber("length_min_m").reshape(-1).tolist(),
        length_max_m=arm.per_chamber("length_max_m").reshape(-1).tolist(),
        bend_max_rad=arm.per_section("bend_max_rad").reshape(-1).tolist(),
        pressure_min_pa=arm.per_chamber("pressure_min_pa").reshape(-1).tolist(),
        pressure_max_pa=arm.per_chamber("pressure_max_pa").reshape(-1).tolist(),
        versions=versions,
        log_path=log_path,
        rate_hz=configuration.control.rate_hz,
        simulator=device.drawn_parameters(configuration.simulated, arm)
        if isinstance(device, SimulatedDevice)
        else {},
    )

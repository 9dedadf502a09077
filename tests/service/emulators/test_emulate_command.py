"""`pneuarm emulate`: the arm behind the device has the valves that were asked for."""

from pathlib import Path

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import EmulatedDevice
from pneuarm.hardware.simulator.parameters import NOMINAL, Valves
from pneuarm.service.cli.parser import build_parser
from pneuarm.service.configuration.devices import devices
from pneuarm.service.emulators.command import _emulated_arm, configuration_of

STEP_PA = np.array([[4e4, 4e4, 4e4]])


def reached_pa(*words: str) -> float:
    """Pressure 0.3 s after a step of 0.4 bar, behind a device emulated with these words."""
    arguments = build_parser().parse_args(["emulate", "festo-cpx", *words])
    arm = _emulated_arm(arguments, configuration_of(arguments.arm))
    arm.advance(0.0)
    arm.set_pressures_pa(STEP_PA, 0.0)
    arm.advance(0.3)
    return float(arm.true_pressures_pa[0, 0])


def file_with(valves: Valves, folder: Path) -> str:
    path = folder / f"{valves}.toml"
    path.write_text(f'[simulator]\nvalves = "{valves}"\n')
    return str(path)


@pytest.mark.parametrize("valves", NOMINAL)
def test_the_option_and_the_file_name_the_same_valves(valves: Valves, tmp_path: Path) -> None:
    by_file = reached_pa("--arm", file_with(valves, tmp_path))
    assert reached_pa("--valves", valves) == by_file
    assert reached_pa("--arm", file_with("servo", tmp_path), "--valves", valves) == by_file


def test_each_kind_fills_at_a_pace_of_its_own() -> None:
    servo, itv, onoff = (reached_pa("--valves", valves) for valves in ("servo", "itv", "onoff"))
    assert servo > onoff + 2e3 > itv + 4e3
    assert reached_pa() == servo


@pytest.mark.parametrize("name", ["festo-cpx", "festo-vtem"])
@pytest.mark.parametrize(
    ("option", "value", "allowed"),
    [
        ("--port", "99999", "65535"),
        ("--port", "-1", "65535"),
        ("--watchdog-ms", "-1", "0"),
        ("--watchdog-ms", str(2**40), "65535"),
    ],
)
def test_what_a_terminal_cannot_be_is_refused(
    name: str, option: str, value: str, allowed: str
) -> None:
    arguments = build_parser().parse_args(["emulate", name, f"{option}={value}"])
    configuration, device = configuration_of(arguments.arm), devices().named(name)
    assert isinstance(device, EmulatedDevice)
    config, arm = configuration.of_device(device), configuration.build_arm()
    emulated = _emulated_arm(arguments, configuration)
    with pytest.raises(ConfigurationError) as refused:  # noqa: SIM117
        with device.emulate(config, arm, emulated, arguments):
            pass
    assert all(fact in str(refused.value) for fact in (value, allowed))

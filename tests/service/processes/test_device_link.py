"""The slots between control and the device process: newest, whole, or not at all."""

import multiprocessing

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.guard import Intervention
from pneuarm.hardware.interface import Measurement
from pneuarm.service.processes.device_slots import (
    DeviceEnd,
    DeviceLink,
    DeviceWatch,
    LinkedDevice,
    LinkState,
    Order,
)

SOME_PA = np.array([[1e4, 2e4, 3e4]])
NANS = np.full((1, 3), np.nan)


def ends() -> tuple[DeviceLink, LinkedDevice, DeviceEnd]:
    link = DeviceLink.create(multiprocessing.get_context("spawn"), 1)
    return link, LinkedDevice(link), DeviceEnd(link)


def test_commands_arrive_newest_only() -> None:
    _, control, device = ends()
    assert device.command() is None
    for number in range(20):
        control.write(SOME_PA * number, 1.0 + number, 1.0 + number)
    command = device.command()
    assert command is not None
    assert (command.sequence, command.order) == (20, Order.REGULATE)
    assert command.commanded_at_s == 20.0
    assert np.array_equal(command.pressures_pa, SOME_PA * 19)
    control.vent(21.0)
    command = device.command()
    assert command is not None
    assert command.order == Order.VENT
    assert np.array_equal(command.pressures_pa, np.zeros((1, 3)))


def test_a_measurement_arrives_whole() -> None:
    _, control, device = ends()
    device.say(LinkState.STARTING, 0.9)
    device.sent(SOME_PA / 2)
    complaints = ("valve 1 is hot", "valve 2 is cold")
    said = Measurement(SOME_PA, NANS, None, 0.95, SOME_PA, 6e5, True, complaints)
    device.measured(said, 1.0, 1.1)
    found = control.read(1.2)
    assert np.array_equal(found.pressures_pa, SOME_PA)
    assert np.isnan(found.lengths_m).all()
    assert found.taken_s == 0.95
    assert np.array_equal(found.setpoints_pa, SOME_PA)  # type: ignore[arg-type]
    assert (found.supply_pa, found.stop_pressed, found.complaints) == (6e5, True, complaints)
    assert np.array_equal(control.sent_pa, SOME_PA / 2)
    device.measured(Measurement(SOME_PA, NANS), 2.0, 2.1)
    found = control.read(2.2)
    assert (found.taken_s, found.setpoints_pa, found.complaints) == (2.0, None, ())


def test_a_torn_command_is_not_taken() -> None:
    link, control, device = ends()
    control.write(SOME_PA, 1.0, 1.0)
    assert device.command() is not None
    control.write(2 * SOME_PA, 2.0, 2.0)
    view, offset = link.commands.view(), link.commands.offset(2)
    view[offset + 20] ^= 0xFF  # in the middle of the payload
    command = device.command()
    assert command is not None
    assert np.array_equal(command.pressures_pa, SOME_PA)
    assert command.commanded_at_s == 1.0


def test_without_a_word_of_the_device_there_is_no_measurement() -> None:
    _, control, device = ends()
    with pytest.raises(HardwareError, match="not reported"):
        control.read(0.0)
    device.say(LinkState.STARTING, 0.0)
    with pytest.raises(HardwareError, match="being connected"):
        control.read(0.1)


def test_an_old_report_is_history() -> None:
    _, control, device = ends()
    device.measured(Measurement(SOME_PA, NANS), 1.0, 1.0)
    control.read(1.2)
    with pytest.raises(HardwareError, match=r"said nothing for 0\.40 s"):
        control.read(1.4)


def test_a_device_that_was_away_is_told_once_and_with_the_reason() -> None:
    link, control, device = ends()
    device.measured(Measurement(SOME_PA, NANS), 1.0, 1.0)
    control.read(1.0)
    device.say(LinkState.LOST, 1.1, "the cable is out")
    with pytest.raises(HardwareError, match="cable"):
        control.read(1.1)
    assert np.isnan(control.sent_pa).all()
    device.say(LinkState.STARTING, 1.2)
    device.measured(Measurement(SOME_PA, NANS), 1.3, 1.3)
    with pytest.raises(HardwareError, match=r"connected again.*cable"):
        control.read(1.3)
    control.read(1.3)
    # A new process in the place of a dead one is noticed too, however quick it was.
    DeviceEnd(link).measured(Measurement(SOME_PA, NANS), 1.4, 1.4)
    with pytest.raises(HardwareError, match="connected again"):
        control.read(1.4)
    standing = DeviceWatch(link).standing()
    assert standing is not None
    assert (standing.state, standing.published_s) == (LinkState.CONNECTED, 1.4)


def test_what_the_guard_changed_is_told_once() -> None:
    _, control, device = ends()
    device.intervened(Intervention.SLEW)
    device.measured(Measurement(SOME_PA, NANS), 1.0, 1.0)
    control.read(1.0)
    assert control.write(SOME_PA, 1.0, 1.0).intervention == Intervention.SLEW
    control.read(1.01)
    assert control.write(SOME_PA, 1.01, 1.01).intervention == Intervention.NOTHING


def test_a_hold_of_what_is_no_number_holds_the_last_number() -> None:
    _, control, device = ends()
    control.write(SOME_PA, 1.0, 1.0)
    broken = SOME_PA.copy()
    broken[0, 1] = np.nan
    assert np.array_equal(control.write(broken, 1.1, 1.1).pressures_pa, SOME_PA)
    command = device.command()
    assert command is not None
    assert np.isnan(command.pressures_pa[0, 1])  # the guard sees it, and counts it

"""From chambers to channels and back, and commands in whole steps."""

import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.channels import Channels, StepCommand
from tools.rig.arms import TABLE1_SECTION, paper_arm, trunk_arm


def test_channels_there_and_back() -> None:
    """Every chamber's value on its own channel, zeros on the others."""
    arm = trunk_arm()
    numbers = tuple(random.Random(1).sample(range(12), arm.n_chambers))
    channels = Channels(arm, 12, numbers, "valves")
    values = np.arange(1.0, 10.0).reshape(3, 3)
    spread = channels.scatter(values)
    assert np.array_equal(channels.gather(spread), values)
    assert sum(spread) == values.sum()


@pytest.mark.parametrize(
    ("count", "numbers", "words"),
    [
        (8, (0, 1, 1), "a channel of its own"),
        (8, (0, 1, 8), "0 to 7"),
        (8, (0, 1, -1), "0 to 7"),
        (8, (0, 1), "3 channels are needed"),
        (2, (0, 1), "has 2 channels"),
    ],
)
def test_channels_that_do_not_fit_are_refused(
    count: int, numbers: tuple[int, ...], words: str
) -> None:
    with pytest.raises(ConfigurationError, match=words):
        Channels(paper_arm(), count, numbers, "[ctrl_p] valves")


@settings(max_examples=300)
@given(
    st.floats(-1e5, 0.0),
    st.floats(1.0, 1e6),
    st.floats(0.1, 900.0),
    st.lists(st.floats(-2e6, 2e6), min_size=3, max_size=3),
)
def test_whole_steps_never_leave_the_limits(
    low: float, high: float, step: float, asked: list[float]
) -> None:
    """However the limits lie between the steps; and no further off than one step."""
    section = replace(TABLE1_SECTION, pressure_min_pa=low, pressure_max_pa=high)
    sent = StepCommand(Arm("any", (section,)), step, "it").sendable_pa(np.array([asked]))
    assert (sent >= low).all()
    assert (sent <= high).all()
    nearest = np.clip(asked, low, high)
    assert (np.abs(sent - nearest) <= step * (1.0 + 1e-9)).all()

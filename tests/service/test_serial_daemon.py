"""A whole daemon on an emulated serial controller: the circle, a pulled cable, the way out."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from logs.schema import pneuarm_pb2 as pb
from service.config import load
from tests.service.daemon import Daemon, arm, enough, keep_moving, wait_for
from tests.service.emulators import Emulator

#: An arm for 13 kPa: soft enough to bend as the others do at a bar.
SOFT = load(None, "paper").arm.sections[0].model_dump() | {
    "pressure_min_bar": 0.0,
    "pressure_max_bar": 0.12,
    "pressure_slew_max_bar_s": 0.6,
    "lengthening_mm_per_bar": 800.0,
}


@pytest.mark.parametrize("adapter", ["ctrl-p", "esp32"])
def test_the_arm_follows_a_circle_and_loses_its_air_when_the_daemon_goes(
    adapter: str, tmp_path: Path
) -> None:
    """The tip follows; a pulled cable is a fault that `reset` leaves; the end is vented."""
    config = tmp_path / "arm.toml"
    own: dict[str, Any] = {} if adapter == "ctrl-p" else {"arm": {"sections": [SOFT]}}
    config.write_text(tomli_w.dumps(own))
    with Emulator(adapter, tmp_path, "--arm", str(config)) as emulator:
        with Daemon(tmp_path, own | emulator.tables) as daemon, daemon.client() as client:
            arm(client)
            keep_moving(client, enough(2.0), "a circle")
            assert emulator.zero_since() is None
            emulator.say("unplug 0.5")
            wait_for(lambda: client.state().mode == pb.FAULT, "a fault")
            wait_for(lambda: daemon.command("reset").returncode == 0, "the reset to be taken")
            wait_for(lambda: client.state().mode == pb.READY, "the arm to be ready again")
            wait_for(emulator.zero_since, "zeros at the controller")
            arm(client)
            keep_moving(client, enough(0.5), "some movement")
        ended_s = time.monotonic()
        zero_s = emulator.zero_since()
        assert zero_s is not None
        assert zero_s < ended_s
    ticks = daemon.log().ticks()
    moving = ticks[(ticks["mode"] == pb.ACTIVE) & (ticks["target_kind"] != 0)]
    off_m = np.linalg.norm(moving["tip_estimated_position_m"] - moving["target_position_m"], axis=1)
    assert np.median(off_m) < 0.03  # of a circle of 60 mm, at the pace of a busy machine

"""`pneuarm learn`: repeat a trajectory, learn from its error, write what was learnt."""

import argparse
import contextlib
import json
import secrets
from collections.abc import Iterator
from pathlib import Path

from pneuarm.controllers.arm.errors import PneuarmError
from pneuarm.controllers.learning.course import Course
from pneuarm.controllers.learning.learning import Learning
from pneuarm.service.client.client import Client
from pneuarm.service.client.target_messages import trajectory_target
from pneuarm.service.configuration.configuration import recorded
from pneuarm.service.learning.apply import checked
from pneuarm.service.learning.drive import Driver, bound_m, require_tip, trial_s
from pneuarm.service.learning.file import require_place
from pneuarm.service.learning.keeping import Keeper
from pneuarm.service.learning.learn import learn
from pneuarm.service.learning.telling import Telling, error_text, say
from pneuarm.service.learning.waypoints import read_waypoints

#: Where more than this share of the error is left, something is told that may be wrong.
_LITTLE = 0.8


def run(arguments: argparse.Namespace) -> int:
    """Learn a trajectory on a running daemon; the arm holds at the end, however it comes."""
    trajectory: Path = arguments.trajectory
    message = trajectory_target(read_waypoints(trajectory))
    output = arguments.output or Path(f"{trajectory.stem}-learned.toml")
    with Client(arguments.arm, arguments.connect, "learn", arguments.zenoh_config) as client:
        configuration = recorded(client.info().config_toml, "the daemon")
        course = Course(checked(configuration, message))
        require_tip(client)
        require_place(output)
        mode_hz = configuration.arm.response.mode_hz
        learning = Learning(course, bound_m(configuration), mode_hz)
        telling = Telling(learning, arguments.trials, trial_s(course))
        keeper = Keeper(learning, configuration, str(trajectory), output, telling)
        driver = Driver(client, course, configuration, telling.elapsed, say)
        first_id = secrets.randbelow(2**16)
        with keeper.saying_what_is_kept(), _holding(client):
            telling.begins(arguments.arm, str(trajectory))
            note = learn(
                learning, arguments.trials, driver.follow, keeper.take, first_id, telling.again
            )
    report(arguments, learning, output, note)
    return 0


@contextlib.contextmanager
def _holding(client: Client) -> Iterator[None]:
    """Arm, and leave the arm holding whatever happens."""
    client.enable()
    try:
        yield
    finally:
        with contextlib.suppress(PneuarmError):
            client.hold()


def report(arguments: argparse.Namespace, learning: Learning, output: Path, note: str) -> None:
    """Print what was learnt, as text or as one JSON object; ``note`` says why it ended early."""
    before, after = learning.trials[0], learning.best
    file = str(output) if learning.has_learnt else None
    if arguments.json:
        rows = [{"rms_mm": 1e3 * t.rms_m, "max_mm": 1e3 * t.max_m} for t in learning.trials]
        best = learning.trials.index(after)
        told = {"arm": arguments.arm, "trajectory": str(arguments.trajectory), "file": file}
        told |= {"trials": rows, "best": best + 1, "note": note}
        print(json.dumps(told | {"before": rows[0], "after": rows[best]}))
        return
    if note:
        print(note)
    if after.rms_m > _LITTLE * before.rms_m:
        print(
            "little was learnt: what is missing does not come alike in every trial; of slow valves "
            "arm.response must know, and feedback.time_constant_ms be no shorter than their lag"
        )
    print(f"before: {error_text(before)}; after: {error_text(after)}")
    if file is None:
        print("no trial was better than the first: nothing was learnt, and no file is written")
    else:
        words = f"send trajectory {arguments.trajectory} --learned {file} --enable"
        print(f"wrote {file}: pneuarm {words}")

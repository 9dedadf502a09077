"""A position out of reach is taken, and said to be out of reach, once."""

from pathlib import Path

from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.logs.schema import pneuarm_pb2 as pb
from tools.rig.daemon import Daemon, wait_for


def test_out_of_reach_is_said_once_with_the_limit_and_the_nearest_point(tmp_path: Path) -> None:
    with Daemon(tmp_path) as daemon, daemon.client() as client:
        client.enable()
        found: list[pb.Event] = []

        def told() -> list[pb.Event]:
            client.send_position((0.3, 0.0, 0.1))
            found.extend(event for event in client.events() if event.code == "out_of_reach")
            return found

        event = wait_for(told, "an event that says so")[0]
        for _ in range(20):
            told()
        assert len(found) == 1
        assert LengthLimit.words in event.text
        assert "(186.5, 0.0, 100.1) mm" in event.text

        def told_anew() -> list[pb.Event]:
            client.send_position((0.0, 0.0, 0.2))  # each time: a single target may be lost
            return told()[1:]

        assert wait_for(told_anew, "a second one after a target within reach")

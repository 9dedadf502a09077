"""The one table of keys: what is said under which key, in which direction, and what is logged.

Everything that publishes, subscribes, records or reads takes the keys from here.
"""

from dataclasses import dataclass

from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.message import Message

from pneuarm.logs.schema import pneuarm_pb2 as pb


@dataclass(frozen=True)
class Topic:
    """One key under ``pneuarm/<arm>/``.

    ``message`` is None where anything may be sent; ``rate_hz`` is the rate of publication, None
    for "when it happens"; ``logged_rate_hz`` the rate in the file, None for "every one".
    """

    key: str
    direction: str  # in, out, query, or file: recorded only
    message: type[Message] | None
    rate_hz: float | None = None
    logged: bool = True
    logged_rate_hz: float | None = None


TARGET = Topic("cmd/target", "in", pb.Target)
ESTOP = Topic("cmd/estop", "in", None, logged=False)  # the event that follows is logged
MODE = Topic("cmd/mode", "query", pb.ModeRequest, logged=False)  # its events are logged
TIP_POSE = Topic("sensor/tip_pose", "in", PoseInFrame)
STATE = Topic("state", "out", pb.ArmState, rate_hz=100.0)
TIP = Topic("tip", "out", PoseInFrame, rate_hz=100.0, logged_rate_hz=100.0)
TF = Topic("tf", "out", FrameTransforms, rate_hz=100.0, logged_rate_hz=100.0)
BODY = Topic("body", "file", PointCloud, logged_rate_hz=20.0)
HEALTH = Topic("health", "out", pb.Health, rate_hz=1.0)
EVENT = Topic("event", "out", pb.Event)
INFO = Topic("info", "query", pb.Info)
EVENTS = Topic("events", "query", pb.Events, logged=False)  # each of them is logged as `event`

TOPICS = (TARGET, ESTOP, MODE, TIP_POSE, STATE, TIP, TF, BODY, HEALTH, EVENT, INFO, EVENTS)
LOGGED = tuple(topic for topic in TOPICS if topic.logged)

#: Liveliness tokens.
ALIVE_DAEMON = "alive/daemon"
ALIVE_CLIENT = "alive/client"


def full_key(arm_name: str, key: str) -> str:
    """Key on the wire and topic in the file."""
    return f"pneuarm/{arm_name}/{key}"


def split_key(topic: str) -> tuple[str, str]:
    """Return the arm's name and the key of a topic in a file; empty strings if it is not ours."""
    parts = topic.split("/", 2)
    if len(parts) != 3 or parts[0] != "pneuarm":
        return "", ""
    return parts[1], parts[2]

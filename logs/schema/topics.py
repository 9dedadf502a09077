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

    ``message`` is None where anything may be sent; ``rate_hz`` is the rate of publication, and
    ``when`` says in words what a rate does not; ``logged_rate_hz`` is the rate in the file, None
    for "every one". ``newest`` says that the newest message also answers queries, ``reply`` what
    a query with a ``message`` is answered by; a query without one is answered by ``message``. A key
    that programs put may be queried too where it has a ``reply``. ``suffix`` may follow the key.
    """

    key: str
    direction: str  # in, out, query, or file: recorded only
    message: type[Message] | None
    rate_hz: float | None = None
    logged: bool = True
    logged_rate_hz: float | None = None
    when: str = ""
    newest: bool = False
    reply: type[Message] | None = None
    suffix: str = ""


TARGET = Topic("cmd/target", "in", pb.Target, when="at least every 200 ms while the arm is to move")
#: Of the stop and of a change of mode the event that follows is logged.
ESTOP = Topic("cmd/estop", "in", None, reply=pb.Reply, logged=False, when="when needed")
MODE = Topic("cmd/mode", "query", pb.ModeRequest, reply=pb.Reply, logged=False, when="when needed")
TIP_POSE = Topic("sensor/tip_pose", "in", PoseInFrame, when="any", suffix="/<source>")
STATE = Topic("state", "out", pb.ArmState, 100.0, newest=True, when="every tick in the log")
TIP = Topic("tip", "out", PoseInFrame, 100.0, logged_rate_hz=100.0, newest=True)
TF = Topic("tf", "out", FrameTransforms, 100.0, logged_rate_hz=100.0, newest=True)
BODY = Topic("body", "file", PointCloud, logged_rate_hz=20.0)
HEALTH = Topic("health", "out", pb.Health, 1.0, newest=True)
EVENT = Topic("event", "out", pb.Event, when="when it happens")
INFO = Topic("info", "query", pb.Info, when="when needed")
EVENTS = Topic("events", "query", pb.Events, logged=False, when="when needed")

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

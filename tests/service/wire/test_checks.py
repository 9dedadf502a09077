"""A message becomes a target, or is refused with the value and what is allowed."""

import numpy as np
import pytest
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from hypothesis import given
from hypothesis import strategies as st

from pneuarm.controllers.arm.errors import TargetRejected
from pneuarm.controllers.targets.targets import (
    KINDS,
    DirectionTarget,
    LawName,
    LengthsTarget,
    PointTarget,
    PoseTarget,
    PositionTarget,
    PostureTarget,
    PressuresTarget,
    TasksTarget,
    TwistTarget,
)
from pneuarm.controllers.targets.together import COMBINED
from pneuarm.logs.schema import pneuarm_pb2 as pb
from pneuarm.logs.schema.codec import JSON, decode
from pneuarm.service.client.target_messages import (
    direction_target,
    point_target,
    pose_target,
    position_target,
    twist_target,
)
from pneuarm.service.configuration.configuration import load
from pneuarm.service.wire.target_checks import TargetChecker

PAPER = TargetChecker(load(preset="paper").build_arm())
TRUNK = TargetChecker(load(preset="trunk").build_arm())
NAN, INF = float("nan"), float("inf")
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def lengths(*values: float) -> pb.Target:
    return pb.Target(lengths=pb.LengthsTarget(length_m=values))


def pressures(*values: float) -> pb.Target:
    return pb.Target(pressures=pb.PressuresTarget(pressure_pa=values))


def in_frame(message: pb.Target, frame_id: str) -> pb.Target:
    getattr(message, message.WhichOneof("target")).frame_id = frame_id
    return message


def at_point(message: pb.Target, point: str) -> pb.Target:
    message.twist.reference_point = point
    return message


def twist(linear: tuple[float, ...], angular: tuple[float, ...] | None = None) -> pb.Target:
    return twist_target(linear, angular, "base", "tip")


def test_every_kind_of_target_has_its_field_and_its_number_on_the_wire() -> None:
    fields = [field.name for field in pb.Target.DESCRIPTOR.oneofs_by_name["target"].fields]
    assert list(KINDS) == fields
    for name, kind in KINDS.items():
        assert pb.TargetKind.Value(name.upper()) == kind.kind
    assert len(pb.TargetKind.keys()) == len(KINDS) + 1  # NO_TARGET


def test_what_may_be_one_of_several_tasks_is_what_the_message_has() -> None:
    fields = [field.name for field in pb.WeightedTask.DESCRIPTOR.oneofs_by_name["task"].fields]
    assert {kind.name for kind in COMBINED} == set(fields)


REFUSED = [
    # message, the value as it is told, what is allowed
    (position_target((NAN, 0, 0)), "position_m = [nan, 0, 0]", "must be finite"),
    (position_target((0, -INF, 0)), "position_m = [0, -inf, 0]", "must be finite"),
    (position_target((40.0, 0.0, 200.0)), "[40, 0, 200] is 204 m", "3 arm lengths; is it in mm?"),
    (position_target((0.0, 0.0, 0.91)), "0.91 m from the base", "is it in mm?"),
    (position_target((1e300, 1e300, 0)), "1.41e+300 m from the base", "is it in mm?"),
    (in_frame(position_target((0, 0, 0.2)), "world"), "frame_id = 'world'", "allowed: 'base'"),
    (in_frame(position_target((0, 0, 0.2)), ""), "frame_id = ''", "allowed: 'base'"),
    (in_frame(position_target((0, 0, 0.2)), "tip"), "frame_id = 'tip'", "allowed: 'base'"),
    (in_frame(pose_target((0, 0, 0.2), UPRIGHT), "map"), "frame_id = 'map'", "allowed: 'base'"),
    (pose_target((0, 0, 200), UPRIGHT), "[0, 0, 200]", "is it in mm?"),
    (pose_target((0, 0, 0.2), (0, 0, 0, 2)), "[0, 0, 0, 2] has the norm 2", "unit quaternion"),
    (pose_target((0, 0, 0.2), (0, 0, 0, 0)), "has the norm 0", "(x, y, z, w) is needed"),
    (pose_target((0, 0, 0.2), (0, NAN, 0, 1)), "orientation = [0, nan, 0, 1]", "must be finite"),
    (twist((5.1, 0, 0)), "linear_m_s = [5.1, 0, 0]", "above 5 m/s; is it in mm/s?"),
    (twist((0, 0, 0), (0, 0, 21)), "angular_rad_s = [0, 0, 21]", "20 rad/s; is it in degrees?"),
    (twist((NAN, 0, 0)), "linear_m_s = [nan, 0, 0]", "must be finite"),
    (twist((0, 0, 0), (INF, 0, 0)), "angular_rad_s = [inf, 0, 0]", "must be finite"),
    (in_frame(twist((0, 0, 0)), "world"), "frame_id = 'world'", "allowed: 'base', 'tip'"),
    (at_point(twist((0, 0, 0)), "elbow"), "reference_point = 'elbow'", "allowed: 'base', 'tip'"),
    (at_point(twist((0, 0, 0)), "base"), "reference_point = 'base'", "needs angular_rad_s"),
    (
        in_frame(at_point(twist((0, 0, 0), (0, 0, 0)), "base"), "tip"),
        "frame_id = 'tip'",
        "goes with reference_point = 'tip'",
    ),
    (lengths(0.2, 0.2), "length_m has 2 values", "arm paper has 3 chambers"),
    (lengths(*[0.2] * 4), "length_m has 4 values", "arm paper has 3 chambers"),
    (lengths(0.2, 0.301, 0.2), "chamber 2 is 0.301 m", "allowed: 0.100001 to 0.299999 m"),
    (lengths(0.2, 0.2, 0.1), "section 1, chamber 3 is 0.1 m", "allowed: 0.100001 to"),
    (lengths(200, 200, 200), "chamber 1 is 200 m", "allowed: 0.100001 to"),
    (lengths(0.2, NAN, 0.2), "length_m = [0.2, nan, 0.2]", "must be finite"),
    (pressures(), "pressure_pa has 0 values", "arm paper has 3 chambers"),
    (pressures(0, 0, 9.1e4), "chamber 3 is 91000 Pa", "allowed: -90000 to 90000 Pa"),
    (pressures(-9.1e4, 0, 0), "chamber 1 is -91000 Pa", "allowed: -90000 to 90000 Pa"),
    (pressures(INF, 0, 0), "pressure_pa = [inf, 0, 0]", "must be finite"),
    (pb.Target(), "holds no target", "position, pose, twist, lengths, pressures"),
    (position_target((0, 0, 0.2), 7), "law = 7", "allowed: 0"),  # type: ignore[arg-type]
]


@pytest.mark.filterwarnings("ignore:overflow")
@pytest.mark.parametrize(("message", "value", "allowed"), REFUSED, ids=[r[1] for r in REFUSED])
def test_a_bad_target_is_refused_with_its_value_and_what_is_allowed(
    message: pb.Target, value: str, allowed: str
) -> None:
    with pytest.raises(TargetRejected) as caught:
        PAPER.target(message)
    text = str(caught.value)
    assert value in text
    assert allowed in text
    assert "\n" not in text
    assert len(text) < 300


def test_an_empty_target_in_json_is_refused() -> None:
    with pytest.raises(TargetRejected, match="holds no target"):
        PAPER.target(decode(pb.Target, b"{}", JSON))


@pytest.mark.parametrize(
    ("message", "field"),
    [
        (pb.Target(position=pb.PositionTarget(frame_id="base")), "position_m"),
        (pb.Target(pose=pb.PoseTarget(position_m=pb.Vector3(z=0.2))), "orientation"),
        (pb.Target(pose=pb.PoseTarget(orientation=pb.Quaternion(w=1.0))), "position_m"),
        (
            pb.Target(twist=pb.TwistTarget(frame_id="base", reference_point="tip")),
            "linear_m_s",
        ),
    ],
)
def test_a_field_that_is_left_out_is_not_taken_for_zeros(message: pb.Target, field: str) -> None:
    with pytest.raises(TargetRejected, match=f"^{field} is missing$"):
        PAPER.target(message)


def test_a_chamber_of_a_later_section_is_named() -> None:
    values = [0.2] * 9
    values[7] = 0.5
    with pytest.raises(TargetRejected, match=r"length_m of section 3, chamber 2 is 0\.5 m"):
        TRUNK.target(lengths(*values))
    assert isinstance(TRUNK.target(lengths(*[0.2] * 9)), LengthsTarget)


def test_good_targets_pass_with_their_numbers() -> None:
    position = PAPER.target(position_target((0.05, -0.02, 0.2), pb.RESOLVED_RATE))
    assert isinstance(position, PositionTarget)
    assert position.position_m.tolist() == [0.05, -0.02, 0.2]
    assert position.law == LawName.RESOLVED_RATE
    pressure = PAPER.target(pressures(9e4, -9e4, 0))
    assert isinstance(pressure, PressuresTarget)
    assert pressure.pressures_pa.tolist() == [[9e4, -9e4, 0.0]]
    length = PAPER.target(lengths(0.100001, 0.2, 0.299999))
    assert isinstance(length, LengthsTarget)
    assert length.lengths_m.shape == (1, 3)


def test_a_nearly_unit_quaternion_is_made_one() -> None:
    target = PAPER.target(pose_target((0, 0, 0.2), (0.0, 0.0, 0.6, 0.8005)))
    assert isinstance(target, PoseTarget)
    assert np.linalg.norm(target.quaternion_xyzw) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("frame", ["base", "tip"])
@pytest.mark.parametrize("angular", [None, (0.0, 0.0, 20.0)])
def test_a_twist_keeps_frame_and_point(frame: str, angular: tuple[float, ...] | None) -> None:
    target = PAPER.target(twist_target((5.0, 0.0, 0.0), angular, frame, "tip"))
    assert isinstance(target, TwistTarget)
    assert (target.in_tip_frame, target.about_base_origin) == (frame == "tip", False)
    assert (target.angular_rad_s is None) == (angular is None)
    about_base = PAPER.target(twist_target((0, 0, 0), (0, 0, 1), "base", "base"))
    assert isinstance(about_base, TwistTarget)
    assert about_base.about_base_origin


NUMBERS = st.floats(allow_nan=True) | st.sampled_from([0.0, 0.2, 1e-310, -0.0, 1e308])
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@given(VECTORS, st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), st.lists(NUMBERS, max_size=10))
@pytest.mark.filterwarnings("ignore:overflow")
def test_no_number_passes_that_is_not_finite_or_too_large(
    vector: tuple[float, ...], quaternion: tuple[float, ...], values: list[float]
) -> None:
    for message in (
        position_target(vector),
        pose_target(vector, quaternion),
        twist(vector, vector),
        lengths(*values),
        pressures(*values),
    ):
        try:
            target = PAPER.target(message)
        except TargetRejected:
            continue
        for value in vars(target).values():
            if isinstance(value, np.ndarray):
                assert np.isfinite(value).all()
                assert np.abs(value).max() <= 9e4


def test_a_measured_pose_is_checked_like_a_target() -> None:
    message = PoseInFrame(frame_id="base")
    message.pose.position.x, message.pose.orientation.w = 0.1, 1.0
    position, quaternion = PAPER.tip_pose(message)
    assert (position.tolist(), quaternion.tolist()) == ([0.1, 0, 0], [0, 0, 0, 1])
    message.pose.position.x = 100.0
    with pytest.raises(TargetRejected, match="is it in mm"):
        PAPER.tip_pose(message)
    message.pose.position.x, message.frame_id = 0.1, "mocap"
    with pytest.raises(TargetRejected, match="frame_id = 'mocap'"):
        PAPER.tip_pose(message)
    message.frame_id, message.pose.orientation.w = "base", 0.5
    with pytest.raises(TargetRejected, match=r"norm 0\.5"):
        PAPER.tip_pose(message)


def weighted(kind: str, weight: float, **fields: object) -> pb.WeightedTask:
    """One of several tasks, from the target of the same kind."""
    made = {
        "position": position_target((0.0, 0.0, 0.2)),
        "pose": pose_target((0.0, 0.0, 0.2), UPRIGHT),
        "direction": direction_target((0.0, 0.0, 2.0)),
        "point": point_target((0.0, 0.0, 0.1), 0.5),
        "lengths": lengths(0.2, 0.2, 0.2),
    }
    task = pb.WeightedTask(weight=weight, **fields)  # type: ignore[arg-type]
    if kind == "posture":
        task.posture.SetInParent()
    elif kind:
        getattr(task, kind).CopyFrom(getattr(made[kind], kind))
    return task


def at_the_tip() -> pb.WeightedTask:
    task = weighted("point", 1.0)
    task.point.station = 1.0
    return task


def together(*tasks: pb.WeightedTask) -> pb.Target:
    return pb.Target(tasks=pb.TasksTarget(tasks=tasks))


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (direction_target((0.0, 0.0, 0.0)), "direction = [0, 0, 0] points nowhere"),
        (direction_target((0.0, NAN, 0.0)), "must be finite"),
        (point_target((0.0, 0.0, 0.2), 0.5), "reaches at most 0.15 m"),
        (point_target((0.0, 0.0, 0.2), 2.0), "station = 2; allowed: above 0"),
        (point_target((0.0, 0.0, 0.2), NAN), "station = nan"),
        (together(), "at least one is needed"),
        (together(weighted("posture", 1.0)), "no task besides posture"),
        (together(weighted("position", 0.0)), "weight of task position is 0; allowed: above 0"),
        (together(weighted("position", -1.0)), "weight of task position is -1"),
        (together(weighted("position", NAN)), "weight of task position is nan"),
        (together(weighted("pose", 1.0, orientation_weight=-2.0)), "orientation_weight of task"),
        (together(weighted("position", 1.0), weighted("pose", 1.0)), "position and pose, which"),
        (together(weighted("direction", 1.0), weighted("pose", 1.0)), "direction and pose, which"),
        (together(weighted("point", 1.0), weighted("point", 1.0)), "tasks holds point twice"),
        (together(at_the_tip(), weighted("position", 1.0)), "point and position, which contradict"),
        (together(weighted("position", 1.0), weighted("", 1.0)), "an empty task"),
    ],
)
def test_the_newer_kinds_of_target_are_refused_with_one_clear_sentence(
    message: pb.Target, said: str
) -> None:
    with pytest.raises(TargetRejected) as refused:
        PAPER.target(message)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_direction_point_and_tasks_become_targets() -> None:
    direction = PAPER.target(direction_target((0.0, 3.0, 4.0)))
    assert isinstance(direction, DirectionTarget)
    np.testing.assert_allclose(direction.direction, [0.0, 0.6, 0.8])
    point = PAPER.target(point_target((0.0, 0.0, 0.1), 0.5))
    assert isinstance(point, PointTarget)
    assert point.station == 0.5
    several = PAPER.target(
        together(weighted("pose", 2.0), weighted("point", 0.5), weighted("posture", 1.0))
    )
    assert isinstance(several, TasksTarget)
    assert [(type(task), task.weight) for task in several.targets] == [
        (PoseTarget, 2.0),
        (PointTarget, 0.5),
        (PostureTarget, 1.0),
    ]
    assert several.targets[0].orientation_weight == 2.0
    apart = PAPER.target(together(weighted("pose", 2.0, orientation_weight=0.25)))
    assert isinstance(apart, TasksTarget)
    assert (apart.targets[0].weight, apart.targets[0].orientation_weight) == (2.0, 0.25)

from google.protobuf import descriptor_pb2 as _descriptor_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Mode(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    MODE_UNSPECIFIED: _ClassVar[Mode]
    IDLE: _ClassVar[Mode]
    READY: _ClassVar[Mode]
    ACTIVE: _ClassVar[Mode]
    HOLD: _ClassVar[Mode]
    FAULT: _ClassVar[Mode]
    ESTOP: _ClassVar[Mode]

class Law(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    DEFAULT: _ClassVar[Law]
    RESOLVED_RATE: _ClassVar[Law]
    QP_IK: _ClassVar[Law]

class TargetKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    NO_TARGET: _ClassVar[TargetKind]
    POSITION: _ClassVar[TargetKind]
    POSE: _ClassVar[TargetKind]
    TWIST: _ClassVar[TargetKind]
    LENGTHS: _ClassVar[TargetKind]
    PRESSURES: _ClassVar[TargetKind]
    DIRECTION: _ClassVar[TargetKind]
    POINT: _ClassVar[TargetKind]
    TASKS: _ClassVar[TargetKind]
    TRAJECTORY: _ClassVar[TargetKind]
    CIRCLE: _ClassVar[TargetKind]
    LINE: _ClassVar[TargetKind]

class EstimateSource(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    NO_SOURCE: _ClassVar[EstimateSource]
    FROM_PRESSURES: _ClassVar[EstimateSource]
    FROM_LENGTHS: _ClassVar[EstimateSource]
    FROM_TIP_POSE: _ClassVar[EstimateSource]

class Reach(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    NO_REACH: _ClassVar[Reach]
    MOVING: _ClassVar[Reach]
    REACHED: _ClassVar[Reach]
    OUT_OF_REACH: _ClassVar[Reach]

class Action(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    ACTION_UNSPECIFIED: _ClassVar[Action]
    TAKE_LEASE: _ClassVar[Action]
    ENABLE: _ClassVar[Action]
    HOLD_NOW: _ClassVar[Action]
    VENT: _ClassVar[Action]
    RESET: _ClassVar[Action]
    RELEASE_LEASE: _ClassVar[Action]

class Refusal(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    NOT_REFUSED: _ClassVar[Refusal]
    BAD_REQUEST: _ClassVar[Refusal]
    LEASE_REFUSED: _ClassVar[Refusal]
    MODE_REFUSED: _ClassVar[Refusal]

class Level(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = ()
    LEVEL_UNSPECIFIED: _ClassVar[Level]
    INFO: _ClassVar[Level]
    WARNING: _ClassVar[Level]
    ERROR: _ClassVar[Level]
MODE_UNSPECIFIED: Mode
IDLE: Mode
READY: Mode
ACTIVE: Mode
HOLD: Mode
FAULT: Mode
ESTOP: Mode
DEFAULT: Law
RESOLVED_RATE: Law
QP_IK: Law
NO_TARGET: TargetKind
POSITION: TargetKind
POSE: TargetKind
TWIST: TargetKind
LENGTHS: TargetKind
PRESSURES: TargetKind
DIRECTION: TargetKind
POINT: TargetKind
TASKS: TargetKind
TRAJECTORY: TargetKind
CIRCLE: TargetKind
LINE: TargetKind
NO_SOURCE: EstimateSource
FROM_PRESSURES: EstimateSource
FROM_LENGTHS: EstimateSource
FROM_TIP_POSE: EstimateSource
NO_REACH: Reach
MOVING: Reach
REACHED: Reach
OUT_OF_REACH: Reach
ACTION_UNSPECIFIED: Action
TAKE_LEASE: Action
ENABLE: Action
HOLD_NOW: Action
VENT: Action
RESET: Action
RELEASE_LEASE: Action
NOT_REFUSED: Refusal
BAD_REQUEST: Refusal
LEASE_REFUSED: Refusal
MODE_REFUSED: Refusal
LEVEL_UNSPECIFIED: Level
INFO: Level
WARNING: Level
ERROR: Level
ELEMENTS_FIELD_NUMBER: _ClassVar[int]
elements: _descriptor.FieldDescriptor

class Vector3(_message.Message):
    __slots__ = ("x", "y", "z")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class Quaternion(_message.Message):
    __slots__ = ("x", "y", "z", "w")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    W_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    w: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ..., w: _Optional[float] = ...) -> None: ...

class PositionTarget(_message.Message):
    __slots__ = ("frame_id", "position_m", "velocity_m_s")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_M_S_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    position_m: Vector3
    velocity_m_s: Vector3
    def __init__(self, frame_id: _Optional[str] = ..., position_m: _Optional[_Union[Vector3, _Mapping]] = ..., velocity_m_s: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class PoseTarget(_message.Message):
    __slots__ = ("frame_id", "position_m", "orientation")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    position_m: Vector3
    orientation: Quaternion
    def __init__(self, frame_id: _Optional[str] = ..., position_m: _Optional[_Union[Vector3, _Mapping]] = ..., orientation: _Optional[_Union[Quaternion, _Mapping]] = ...) -> None: ...

class TwistTarget(_message.Message):
    __slots__ = ("frame_id", "reference_point", "linear_m_s", "angular_rad_s")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    REFERENCE_POINT_FIELD_NUMBER: _ClassVar[int]
    LINEAR_M_S_FIELD_NUMBER: _ClassVar[int]
    ANGULAR_RAD_S_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    reference_point: str
    linear_m_s: Vector3
    angular_rad_s: Vector3
    def __init__(self, frame_id: _Optional[str] = ..., reference_point: _Optional[str] = ..., linear_m_s: _Optional[_Union[Vector3, _Mapping]] = ..., angular_rad_s: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class LengthsTarget(_message.Message):
    __slots__ = ("length_m",)
    LENGTH_M_FIELD_NUMBER: _ClassVar[int]
    length_m: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, length_m: _Optional[_Iterable[float]] = ...) -> None: ...

class PressuresTarget(_message.Message):
    __slots__ = ("pressure_pa",)
    PRESSURE_PA_FIELD_NUMBER: _ClassVar[int]
    pressure_pa: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, pressure_pa: _Optional[_Iterable[float]] = ...) -> None: ...

class DirectionTarget(_message.Message):
    __slots__ = ("frame_id", "direction")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    DIRECTION_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    direction: Vector3
    def __init__(self, frame_id: _Optional[str] = ..., direction: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class PointTarget(_message.Message):
    __slots__ = ("frame_id", "position_m", "station")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    STATION_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    position_m: Vector3
    station: float
    def __init__(self, frame_id: _Optional[str] = ..., position_m: _Optional[_Union[Vector3, _Mapping]] = ..., station: _Optional[float] = ...) -> None: ...

class PostureTarget(_message.Message):
    __slots__ = ()
    def __init__(self) -> None: ...

class WeightedTask(_message.Message):
    __slots__ = ("weight", "orientation_weight", "position", "pose", "direction", "point", "lengths", "posture")
    WEIGHT_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_WEIGHT_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    DIRECTION_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    LENGTHS_FIELD_NUMBER: _ClassVar[int]
    POSTURE_FIELD_NUMBER: _ClassVar[int]
    weight: float
    orientation_weight: float
    position: PositionTarget
    pose: PoseTarget
    direction: DirectionTarget
    point: PointTarget
    lengths: LengthsTarget
    posture: PostureTarget
    def __init__(self, weight: _Optional[float] = ..., orientation_weight: _Optional[float] = ..., position: _Optional[_Union[PositionTarget, _Mapping]] = ..., pose: _Optional[_Union[PoseTarget, _Mapping]] = ..., direction: _Optional[_Union[DirectionTarget, _Mapping]] = ..., point: _Optional[_Union[PointTarget, _Mapping]] = ..., lengths: _Optional[_Union[LengthsTarget, _Mapping]] = ..., posture: _Optional[_Union[PostureTarget, _Mapping]] = ...) -> None: ...

class TasksTarget(_message.Message):
    __slots__ = ("tasks",)
    TASKS_FIELD_NUMBER: _ClassVar[int]
    tasks: _containers.RepeatedCompositeFieldContainer[WeightedTask]
    def __init__(self, tasks: _Optional[_Iterable[_Union[WeightedTask, _Mapping]]] = ...) -> None: ...

class Waypoint(_message.Message):
    __slots__ = ("time_s", "position_m")
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    time_s: float
    position_m: Vector3
    def __init__(self, time_s: _Optional[float] = ..., position_m: _Optional[_Union[Vector3, _Mapping]] = ...) -> None: ...

class TrajectoryTarget(_message.Message):
    __slots__ = ("frame_id", "id", "waypoints")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    WAYPOINTS_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    id: int
    waypoints: _containers.RepeatedCompositeFieldContainer[Waypoint]
    def __init__(self, frame_id: _Optional[str] = ..., id: _Optional[int] = ..., waypoints: _Optional[_Iterable[_Union[Waypoint, _Mapping]]] = ...) -> None: ...

class CircleTarget(_message.Message):
    __slots__ = ("frame_id", "id", "center_m", "normal", "radius_m", "frequency_hz", "turns")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    CENTER_M_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    FREQUENCY_HZ_FIELD_NUMBER: _ClassVar[int]
    TURNS_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    id: int
    center_m: Vector3
    normal: Vector3
    radius_m: float
    frequency_hz: float
    turns: float
    def __init__(self, frame_id: _Optional[str] = ..., id: _Optional[int] = ..., center_m: _Optional[_Union[Vector3, _Mapping]] = ..., normal: _Optional[_Union[Vector3, _Mapping]] = ..., radius_m: _Optional[float] = ..., frequency_hz: _Optional[float] = ..., turns: _Optional[float] = ...) -> None: ...

class LineTarget(_message.Message):
    __slots__ = ("frame_id", "id", "start_m", "end_m", "period_s", "repeats")
    FRAME_ID_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    START_M_FIELD_NUMBER: _ClassVar[int]
    END_M_FIELD_NUMBER: _ClassVar[int]
    PERIOD_S_FIELD_NUMBER: _ClassVar[int]
    REPEATS_FIELD_NUMBER: _ClassVar[int]
    frame_id: str
    id: int
    start_m: Vector3
    end_m: Vector3
    period_s: float
    repeats: float
    def __init__(self, frame_id: _Optional[str] = ..., id: _Optional[int] = ..., start_m: _Optional[_Union[Vector3, _Mapping]] = ..., end_m: _Optional[_Union[Vector3, _Mapping]] = ..., period_s: _Optional[float] = ..., repeats: _Optional[float] = ...) -> None: ...

class Target(_message.Message):
    __slots__ = ("client_id", "lease_secret", "sequence", "state_sequence", "law", "position", "pose", "twist", "lengths", "pressures", "direction", "point", "tasks", "trajectory", "circle", "line")
    CLIENT_ID_FIELD_NUMBER: _ClassVar[int]
    LEASE_SECRET_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    STATE_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    LAW_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    POSE_FIELD_NUMBER: _ClassVar[int]
    TWIST_FIELD_NUMBER: _ClassVar[int]
    LENGTHS_FIELD_NUMBER: _ClassVar[int]
    PRESSURES_FIELD_NUMBER: _ClassVar[int]
    DIRECTION_FIELD_NUMBER: _ClassVar[int]
    POINT_FIELD_NUMBER: _ClassVar[int]
    TASKS_FIELD_NUMBER: _ClassVar[int]
    TRAJECTORY_FIELD_NUMBER: _ClassVar[int]
    CIRCLE_FIELD_NUMBER: _ClassVar[int]
    LINE_FIELD_NUMBER: _ClassVar[int]
    client_id: str
    lease_secret: str
    sequence: int
    state_sequence: int
    law: Law
    position: PositionTarget
    pose: PoseTarget
    twist: TwistTarget
    lengths: LengthsTarget
    pressures: PressuresTarget
    direction: DirectionTarget
    point: PointTarget
    tasks: TasksTarget
    trajectory: TrajectoryTarget
    circle: CircleTarget
    line: LineTarget
    def __init__(self, client_id: _Optional[str] = ..., lease_secret: _Optional[str] = ..., sequence: _Optional[int] = ..., state_sequence: _Optional[int] = ..., law: _Optional[_Union[Law, str]] = ..., position: _Optional[_Union[PositionTarget, _Mapping]] = ..., pose: _Optional[_Union[PoseTarget, _Mapping]] = ..., twist: _Optional[_Union[TwistTarget, _Mapping]] = ..., lengths: _Optional[_Union[LengthsTarget, _Mapping]] = ..., pressures: _Optional[_Union[PressuresTarget, _Mapping]] = ..., direction: _Optional[_Union[DirectionTarget, _Mapping]] = ..., point: _Optional[_Union[PointTarget, _Mapping]] = ..., tasks: _Optional[_Union[TasksTarget, _Mapping]] = ..., trajectory: _Optional[_Union[TrajectoryTarget, _Mapping]] = ..., circle: _Optional[_Union[CircleTarget, _Mapping]] = ..., line: _Optional[_Union[LineTarget, _Mapping]] = ...) -> None: ...

class ModeRequest(_message.Message):
    __slots__ = ("client_id", "lease_secret", "action", "take_over")
    CLIENT_ID_FIELD_NUMBER: _ClassVar[int]
    LEASE_SECRET_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    TAKE_OVER_FIELD_NUMBER: _ClassVar[int]
    client_id: str
    lease_secret: str
    action: Action
    take_over: bool
    def __init__(self, client_id: _Optional[str] = ..., lease_secret: _Optional[str] = ..., action: _Optional[_Union[Action, str]] = ..., take_over: bool = ...) -> None: ...

class Reply(_message.Message):
    __slots__ = ("accepted", "reason", "mode", "lease_secret", "lease_holder", "state_sequence", "refusal")
    ACCEPTED_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    LEASE_SECRET_FIELD_NUMBER: _ClassVar[int]
    LEASE_HOLDER_FIELD_NUMBER: _ClassVar[int]
    STATE_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    REFUSAL_FIELD_NUMBER: _ClassVar[int]
    accepted: bool
    reason: str
    mode: Mode
    lease_secret: str
    lease_holder: str
    state_sequence: int
    refusal: Refusal
    def __init__(self, accepted: bool = ..., reason: _Optional[str] = ..., mode: _Optional[_Union[Mode, str]] = ..., lease_secret: _Optional[str] = ..., lease_holder: _Optional[str] = ..., state_sequence: _Optional[int] = ..., refusal: _Optional[_Union[Refusal, str]] = ...) -> None: ...

class ArmState(_message.Message):
    __slots__ = ("sequence", "time_unix_ns", "mode", "n_sections", "law", "target_kind", "target_sequence", "target_age_s", "reach", "binding_limits", "target_error_m", "target_position_m", "target_orientation_xyzw", "length_commanded_m", "length_estimated_m", "length_measured_m", "pressure_commanded_pa", "pressure_sent_pa", "pressure_measured_pa", "tip_commanded_position_m", "tip_estimated_position_m", "tip_estimated_orientation_xyzw", "tip_measured_position_m", "tip_measured_orientation_xyzw", "tip_measured_age_s", "tip_true_position_m", "tip_true_orientation_xyzw", "guard_intervention", "guard_interventions", "qp_fallbacks", "wake_latency_s", "compute_s", "overruns", "active_faults", "supply_pa", "measurement_age_s", "guard_range", "guard_slew", "guard_not_finite", "guard_too_old", "guard_supply", "reference_position_m", "reference_velocity_m_s", "reference_error_m", "tip_model_position_m", "tip_offset_m", "tip_offset_orientation_xyzw", "tip_estimated_sigma_m", "tip_estimated_source", "tip_poses_refused", "log_missed")
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TIME_UNIX_NS_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    N_SECTIONS_FIELD_NUMBER: _ClassVar[int]
    LAW_FIELD_NUMBER: _ClassVar[int]
    TARGET_KIND_FIELD_NUMBER: _ClassVar[int]
    TARGET_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TARGET_AGE_S_FIELD_NUMBER: _ClassVar[int]
    REACH_FIELD_NUMBER: _ClassVar[int]
    BINDING_LIMITS_FIELD_NUMBER: _ClassVar[int]
    TARGET_ERROR_M_FIELD_NUMBER: _ClassVar[int]
    TARGET_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    TARGET_ORIENTATION_XYZW_FIELD_NUMBER: _ClassVar[int]
    LENGTH_COMMANDED_M_FIELD_NUMBER: _ClassVar[int]
    LENGTH_ESTIMATED_M_FIELD_NUMBER: _ClassVar[int]
    LENGTH_MEASURED_M_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_COMMANDED_PA_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_SENT_PA_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_MEASURED_PA_FIELD_NUMBER: _ClassVar[int]
    TIP_COMMANDED_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    TIP_ESTIMATED_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    TIP_ESTIMATED_ORIENTATION_XYZW_FIELD_NUMBER: _ClassVar[int]
    TIP_MEASURED_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    TIP_MEASURED_ORIENTATION_XYZW_FIELD_NUMBER: _ClassVar[int]
    TIP_MEASURED_AGE_S_FIELD_NUMBER: _ClassVar[int]
    TIP_TRUE_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    TIP_TRUE_ORIENTATION_XYZW_FIELD_NUMBER: _ClassVar[int]
    GUARD_INTERVENTION_FIELD_NUMBER: _ClassVar[int]
    GUARD_INTERVENTIONS_FIELD_NUMBER: _ClassVar[int]
    QP_FALLBACKS_FIELD_NUMBER: _ClassVar[int]
    WAKE_LATENCY_S_FIELD_NUMBER: _ClassVar[int]
    COMPUTE_S_FIELD_NUMBER: _ClassVar[int]
    OVERRUNS_FIELD_NUMBER: _ClassVar[int]
    ACTIVE_FAULTS_FIELD_NUMBER: _ClassVar[int]
    SUPPLY_PA_FIELD_NUMBER: _ClassVar[int]
    MEASUREMENT_AGE_S_FIELD_NUMBER: _ClassVar[int]
    GUARD_RANGE_FIELD_NUMBER: _ClassVar[int]
    GUARD_SLEW_FIELD_NUMBER: _ClassVar[int]
    GUARD_NOT_FINITE_FIELD_NUMBER: _ClassVar[int]
    GUARD_TOO_OLD_FIELD_NUMBER: _ClassVar[int]
    GUARD_SUPPLY_FIELD_NUMBER: _ClassVar[int]
    REFERENCE_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    REFERENCE_VELOCITY_M_S_FIELD_NUMBER: _ClassVar[int]
    REFERENCE_ERROR_M_FIELD_NUMBER: _ClassVar[int]
    TIP_MODEL_POSITION_M_FIELD_NUMBER: _ClassVar[int]
    TIP_OFFSET_M_FIELD_NUMBER: _ClassVar[int]
    TIP_OFFSET_ORIENTATION_XYZW_FIELD_NUMBER: _ClassVar[int]
    TIP_ESTIMATED_SIGMA_M_FIELD_NUMBER: _ClassVar[int]
    TIP_ESTIMATED_SOURCE_FIELD_NUMBER: _ClassVar[int]
    TIP_POSES_REFUSED_FIELD_NUMBER: _ClassVar[int]
    LOG_MISSED_FIELD_NUMBER: _ClassVar[int]
    sequence: int
    time_unix_ns: int
    mode: Mode
    n_sections: int
    law: Law
    target_kind: TargetKind
    target_sequence: int
    target_age_s: float
    reach: Reach
    binding_limits: int
    target_error_m: float
    target_position_m: _containers.RepeatedScalarFieldContainer[float]
    target_orientation_xyzw: _containers.RepeatedScalarFieldContainer[float]
    length_commanded_m: _containers.RepeatedScalarFieldContainer[float]
    length_estimated_m: _containers.RepeatedScalarFieldContainer[float]
    length_measured_m: _containers.RepeatedScalarFieldContainer[float]
    pressure_commanded_pa: _containers.RepeatedScalarFieldContainer[float]
    pressure_sent_pa: _containers.RepeatedScalarFieldContainer[float]
    pressure_measured_pa: _containers.RepeatedScalarFieldContainer[float]
    tip_commanded_position_m: _containers.RepeatedScalarFieldContainer[float]
    tip_estimated_position_m: _containers.RepeatedScalarFieldContainer[float]
    tip_estimated_orientation_xyzw: _containers.RepeatedScalarFieldContainer[float]
    tip_measured_position_m: _containers.RepeatedScalarFieldContainer[float]
    tip_measured_orientation_xyzw: _containers.RepeatedScalarFieldContainer[float]
    tip_measured_age_s: float
    tip_true_position_m: _containers.RepeatedScalarFieldContainer[float]
    tip_true_orientation_xyzw: _containers.RepeatedScalarFieldContainer[float]
    guard_intervention: int
    guard_interventions: int
    qp_fallbacks: int
    wake_latency_s: float
    compute_s: float
    overruns: int
    active_faults: int
    supply_pa: float
    measurement_age_s: float
    guard_range: int
    guard_slew: int
    guard_not_finite: int
    guard_too_old: int
    guard_supply: int
    reference_position_m: _containers.RepeatedScalarFieldContainer[float]
    reference_velocity_m_s: _containers.RepeatedScalarFieldContainer[float]
    reference_error_m: float
    tip_model_position_m: _containers.RepeatedScalarFieldContainer[float]
    tip_offset_m: _containers.RepeatedScalarFieldContainer[float]
    tip_offset_orientation_xyzw: _containers.RepeatedScalarFieldContainer[float]
    tip_estimated_sigma_m: float
    tip_estimated_source: EstimateSource
    tip_poses_refused: int
    log_missed: int
    def __init__(self, sequence: _Optional[int] = ..., time_unix_ns: _Optional[int] = ..., mode: _Optional[_Union[Mode, str]] = ..., n_sections: _Optional[int] = ..., law: _Optional[_Union[Law, str]] = ..., target_kind: _Optional[_Union[TargetKind, str]] = ..., target_sequence: _Optional[int] = ..., target_age_s: _Optional[float] = ..., reach: _Optional[_Union[Reach, str]] = ..., binding_limits: _Optional[int] = ..., target_error_m: _Optional[float] = ..., target_position_m: _Optional[_Iterable[float]] = ..., target_orientation_xyzw: _Optional[_Iterable[float]] = ..., length_commanded_m: _Optional[_Iterable[float]] = ..., length_estimated_m: _Optional[_Iterable[float]] = ..., length_measured_m: _Optional[_Iterable[float]] = ..., pressure_commanded_pa: _Optional[_Iterable[float]] = ..., pressure_sent_pa: _Optional[_Iterable[float]] = ..., pressure_measured_pa: _Optional[_Iterable[float]] = ..., tip_commanded_position_m: _Optional[_Iterable[float]] = ..., tip_estimated_position_m: _Optional[_Iterable[float]] = ..., tip_estimated_orientation_xyzw: _Optional[_Iterable[float]] = ..., tip_measured_position_m: _Optional[_Iterable[float]] = ..., tip_measured_orientation_xyzw: _Optional[_Iterable[float]] = ..., tip_measured_age_s: _Optional[float] = ..., tip_true_position_m: _Optional[_Iterable[float]] = ..., tip_true_orientation_xyzw: _Optional[_Iterable[float]] = ..., guard_intervention: _Optional[int] = ..., guard_interventions: _Optional[int] = ..., qp_fallbacks: _Optional[int] = ..., wake_latency_s: _Optional[float] = ..., compute_s: _Optional[float] = ..., overruns: _Optional[int] = ..., active_faults: _Optional[int] = ..., supply_pa: _Optional[float] = ..., measurement_age_s: _Optional[float] = ..., guard_range: _Optional[int] = ..., guard_slew: _Optional[int] = ..., guard_not_finite: _Optional[int] = ..., guard_too_old: _Optional[int] = ..., guard_supply: _Optional[int] = ..., reference_position_m: _Optional[_Iterable[float]] = ..., reference_velocity_m_s: _Optional[_Iterable[float]] = ..., reference_error_m: _Optional[float] = ..., tip_model_position_m: _Optional[_Iterable[float]] = ..., tip_offset_m: _Optional[_Iterable[float]] = ..., tip_offset_orientation_xyzw: _Optional[_Iterable[float]] = ..., tip_estimated_sigma_m: _Optional[float] = ..., tip_estimated_source: _Optional[_Union[EstimateSource, str]] = ..., tip_poses_refused: _Optional[int] = ..., log_missed: _Optional[int] = ...) -> None: ...

class Event(_message.Message):
    __slots__ = ("time_unix_ns", "level", "source", "code", "text", "cause", "remedy", "client_id", "mode", "payload", "key", "target_sequence")
    TIME_UNIX_NS_FIELD_NUMBER: _ClassVar[int]
    LEVEL_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    CODE_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    CAUSE_FIELD_NUMBER: _ClassVar[int]
    REMEDY_FIELD_NUMBER: _ClassVar[int]
    CLIENT_ID_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    PAYLOAD_FIELD_NUMBER: _ClassVar[int]
    KEY_FIELD_NUMBER: _ClassVar[int]
    TARGET_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    time_unix_ns: int
    level: Level
    source: str
    code: str
    text: str
    cause: str
    remedy: str
    client_id: str
    mode: Mode
    payload: bytes
    key: str
    target_sequence: int
    def __init__(self, time_unix_ns: _Optional[int] = ..., level: _Optional[_Union[Level, str]] = ..., source: _Optional[str] = ..., code: _Optional[str] = ..., text: _Optional[str] = ..., cause: _Optional[str] = ..., remedy: _Optional[str] = ..., client_id: _Optional[str] = ..., mode: _Optional[_Union[Mode, str]] = ..., payload: _Optional[bytes] = ..., key: _Optional[str] = ..., target_sequence: _Optional[int] = ...) -> None: ...

class ProcessHealth(_message.Message):
    __slots__ = ("name", "pid", "cpu_share", "memory_bytes", "dropped", "restarts")
    NAME_FIELD_NUMBER: _ClassVar[int]
    PID_FIELD_NUMBER: _ClassVar[int]
    CPU_SHARE_FIELD_NUMBER: _ClassVar[int]
    MEMORY_BYTES_FIELD_NUMBER: _ClassVar[int]
    DROPPED_FIELD_NUMBER: _ClassVar[int]
    RESTARTS_FIELD_NUMBER: _ClassVar[int]
    name: str
    pid: int
    cpu_share: float
    memory_bytes: int
    dropped: int
    restarts: int
    def __init__(self, name: _Optional[str] = ..., pid: _Optional[int] = ..., cpu_share: _Optional[float] = ..., memory_bytes: _Optional[int] = ..., dropped: _Optional[int] = ..., restarts: _Optional[int] = ...) -> None: ...

class Latency(_message.Message):
    __slots__ = ("p50", "p99", "max")
    P50_FIELD_NUMBER: _ClassVar[int]
    P99_FIELD_NUMBER: _ClassVar[int]
    MAX_FIELD_NUMBER: _ClassVar[int]
    p50: float
    p99: float
    max: float
    def __init__(self, p50: _Optional[float] = ..., p99: _Optional[float] = ..., max: _Optional[float] = ...) -> None: ...

class Health(_message.Message):
    __slots__ = ("time_unix_ns", "ticks", "rate_hz", "wake_us", "compute_us", "overruns", "rejected_messages", "command_drops", "lease_holder", "disk_free_bytes", "processes")
    TIME_UNIX_NS_FIELD_NUMBER: _ClassVar[int]
    TICKS_FIELD_NUMBER: _ClassVar[int]
    RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    WAKE_US_FIELD_NUMBER: _ClassVar[int]
    COMPUTE_US_FIELD_NUMBER: _ClassVar[int]
    OVERRUNS_FIELD_NUMBER: _ClassVar[int]
    REJECTED_MESSAGES_FIELD_NUMBER: _ClassVar[int]
    COMMAND_DROPS_FIELD_NUMBER: _ClassVar[int]
    LEASE_HOLDER_FIELD_NUMBER: _ClassVar[int]
    DISK_FREE_BYTES_FIELD_NUMBER: _ClassVar[int]
    PROCESSES_FIELD_NUMBER: _ClassVar[int]
    time_unix_ns: int
    ticks: int
    rate_hz: float
    wake_us: Latency
    compute_us: Latency
    overruns: int
    rejected_messages: int
    command_drops: int
    lease_holder: str
    disk_free_bytes: int
    processes: _containers.RepeatedCompositeFieldContainer[ProcessHealth]
    def __init__(self, time_unix_ns: _Optional[int] = ..., ticks: _Optional[int] = ..., rate_hz: _Optional[float] = ..., wake_us: _Optional[_Union[Latency, _Mapping]] = ..., compute_us: _Optional[_Union[Latency, _Mapping]] = ..., overruns: _Optional[int] = ..., rejected_messages: _Optional[int] = ..., command_drops: _Optional[int] = ..., lease_holder: _Optional[str] = ..., disk_free_bytes: _Optional[int] = ..., processes: _Optional[_Iterable[_Union[ProcessHealth, _Mapping]]] = ...) -> None: ...

class Info(_message.Message):
    __slots__ = ("arm", "config_toml", "length_min_m", "length_max_m", "bend_max_rad", "pressure_min_pa", "pressure_max_pa", "versions", "log_path", "rate_hz", "simulator")
    class VersionsEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: str
        def __init__(self, key: _Optional[str] = ..., value: _Optional[str] = ...) -> None: ...
    class SimulatorEntry(_message.Message):
        __slots__ = ("key", "value")
        KEY_FIELD_NUMBER: _ClassVar[int]
        VALUE_FIELD_NUMBER: _ClassVar[int]
        key: str
        value: float
        def __init__(self, key: _Optional[str] = ..., value: _Optional[float] = ...) -> None: ...
    ARM_FIELD_NUMBER: _ClassVar[int]
    CONFIG_TOML_FIELD_NUMBER: _ClassVar[int]
    LENGTH_MIN_M_FIELD_NUMBER: _ClassVar[int]
    LENGTH_MAX_M_FIELD_NUMBER: _ClassVar[int]
    BEND_MAX_RAD_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_MIN_PA_FIELD_NUMBER: _ClassVar[int]
    PRESSURE_MAX_PA_FIELD_NUMBER: _ClassVar[int]
    VERSIONS_FIELD_NUMBER: _ClassVar[int]
    LOG_PATH_FIELD_NUMBER: _ClassVar[int]
    RATE_HZ_FIELD_NUMBER: _ClassVar[int]
    SIMULATOR_FIELD_NUMBER: _ClassVar[int]
    arm: str
    config_toml: str
    length_min_m: _containers.RepeatedScalarFieldContainer[float]
    length_max_m: _containers.RepeatedScalarFieldContainer[float]
    bend_max_rad: _containers.RepeatedScalarFieldContainer[float]
    pressure_min_pa: _containers.RepeatedScalarFieldContainer[float]
    pressure_max_pa: _containers.RepeatedScalarFieldContainer[float]
    versions: _containers.ScalarMap[str, str]
    log_path: str
    rate_hz: float
    simulator: _containers.ScalarMap[str, float]
    def __init__(self, arm: _Optional[str] = ..., config_toml: _Optional[str] = ..., length_min_m: _Optional[_Iterable[float]] = ..., length_max_m: _Optional[_Iterable[float]] = ..., bend_max_rad: _Optional[_Iterable[float]] = ..., pressure_min_pa: _Optional[_Iterable[float]] = ..., pressure_max_pa: _Optional[_Iterable[float]] = ..., versions: _Optional[_Mapping[str, str]] = ..., log_path: _Optional[str] = ..., rate_hz: _Optional[float] = ..., simulator: _Optional[_Mapping[str, float]] = ...) -> None: ...

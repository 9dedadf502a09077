"""Bad input: every public function says which argument, which value, where, and what is allowed."""

from collections.abc import Callable

import numpy as np
import pytest

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics import (
    checks,
    constant_curvature,
    inverse,
    jacobians,
    parameters,
    serial_chain,
)
from tools.rig.arms import paper_arm, trunk_arm

ARM, TRUNK = paper_arm(), trunk_arm()
REST = TRUNK.rest_lengths_m
NAN = float("nan")
LENGTH_FUNCTIONS: list[Callable[..., object]] = [
    constant_curvature.tip_transform,
    constant_curvature.section_end_transforms,
    jacobians.station_transforms,
    jacobians.jacobians,
    lambda arm, lengths: jacobians.stations_at(arm, lengths, 0.1),
]
CHAIN_FUNCTIONS: list[Callable[..., object]] = [
    serial_chain.chain_frames,
    serial_chain.chain_transform,
    serial_chain.paper_transform,
    serial_chain.velocity_jacobian,
    serial_chain.propagated_jacobian,
    serial_chain.serial_jacobian,
]


def with_value(array: np.ndarray, index: tuple[int, ...], value: float) -> np.ndarray:
    changed = array.copy()
    changed[index] = value
    return changed


@pytest.mark.parametrize("function", LENGTH_FUNCTIONS)
@pytest.mark.parametrize("value", [0.225, 0.0749, -0.1, 0.0, NAN, np.inf, -np.inf])
def test_a_length_outside_the_open_interval_is_named_with_its_place(
    function: Callable[..., object], value: float
) -> None:
    batch = np.stack([REST, with_value(REST, (0, 2), value)])
    pattern = rf"lengths_m\[1, 0, 2\] = {value}: .*section 0 lies inside \(0.075, 0.225\) m"
    with pytest.raises(InvalidInput, match=pattern):
        function(TRUNK, batch)


@pytest.mark.parametrize("function", LENGTH_FUNCTIONS)
@pytest.mark.parametrize("shape", [(3,), (9,), (2, 3), (3, 4), (1, 3), ()])
def test_an_array_of_another_shape_is_refused(
    function: Callable[..., object], shape: tuple[int, ...]
) -> None:
    with pytest.raises(InvalidInput, match=r"lengths_m has the shape .*\(\.\.\., 3, 3\) is needed"):
        function(TRUNK, np.full(shape, 0.12))


@pytest.mark.parametrize("values", ["0.2", [["a"]], [[0.2, 0.2], [0.2]], None, object()])
def test_what_is_no_array_of_numbers_is_refused(values: object) -> None:
    with pytest.raises(InvalidInput, match="lengths_m"):
        constant_curvature.tip_transform(ARM, values)  # type: ignore[arg-type]


@pytest.mark.parametrize("function", CHAIN_FUNCTIONS)
@pytest.mark.parametrize(
    ("arguments", "pattern"),
    [
        ((0.1, 0.2, -0.3), r"radius_m = -0.3: the radius of curvature must be above 0"),
        ((0.1, 0.2, 0.0), r"radius_m = 0.0: .*above 0"),
        ((0.1, 0.2, np.inf), r"radius_m = inf: .*finite"),
        ((NAN, 0.2, 0.3), r"phi_rad = nan: it must be finite"),
        ((0.1, np.inf, 0.3), r"theta_rad = inf: it must be finite"),
        ((0.1, 0.2, [0.3, -1.0]), r"radius_m\[1\] = -1.0: .*above 0"),
        ((0.1, [[0.2, NAN]], 0.3), r"theta_rad\[0, 1\] = nan"),
        (([0.1] * 2, [0.2] * 3, 0.3), r"phi_rad \(2,\), theta_rad \(3,\), radius_m \(\)"),
    ],
)
def test_the_papers_parameters_are_checked(
    function: Callable[..., object], arguments: tuple[object, ...], pattern: str
) -> None:
    with pytest.raises(InvalidInput, match=pattern):
        function(*arguments)


def mirrored() -> np.ndarray:
    return np.diag([1.0, 1.0, -1.0, 1.0])


def stretched() -> np.ndarray:
    return np.diag([1.0, 1.001, 1.0, 1.0])


POSES = [
    (mirrored(), r"transform \(rotation\)\[1\] = .*a rotation is needed"),
    (stretched(), r"transform \(rotation\)\[1\] = .*orthonormal with determinant \+1"),
    (np.zeros((4, 4)), r"transform\[1\] = .*last row of a transform is 0 0 0 1"),
    (with_value(np.eye(4), (3, 0), 0.1), r"transform\[1\] = .*last row"),
    (with_value(np.eye(4), (0, 3), NAN), r"transform\[1, 0, 3\] = nan: it must be finite"),
]


@pytest.mark.parametrize("arm", [ARM, TRUNK], ids=["paper", "trunk"])
@pytest.mark.parametrize(("pose", "pattern"), POSES)
def test_a_pose_that_is_none_is_refused(arm: object, pose: np.ndarray, pattern: str) -> None:
    with pytest.raises(InvalidInput, match=pattern):
        inverse.inverse(arm, np.stack([np.eye(4), pose]))  # type: ignore[arg-type]


@pytest.mark.parametrize("shape", [(3, 3), (4,), (4, 3)])
def test_a_pose_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInput, match=r"transform has the shape .*\(\.\.\., 4, 4\) is needed"):
        inverse.inverse(ARM, np.ones(shape))


def test_a_rotation_from_single_precision_is_one() -> None:
    turned = constant_curvature.section_transforms(np.array([0.2, 0.7, -1.1]))[:3, :3]
    checks.rotations("rotation", turned.astype(np.float32))


SHAPE_FUNCTIONS: list[tuple[Callable[[np.ndarray], object], str]] = [
    (constant_curvature.section_transforms, "shapes"),
    (jacobians.section_jacobians, "shapes"),
    (parameters.arcs_from_shapes, "shapes"),
    (parameters.arc_rates, "shapes"),
    (lambda values: parameters.in_frame(np.eye(4), values, "paper"), "shapes"),
    (lambda values: constant_curvature.lengths_from_shapes(values, 0.038), "shapes"),
    (lambda values: constant_curvature.shapes_from_lengths(values, 0.038), "lengths_m"),
    (lambda values: parameters.arcs_from_lengths(values, 0.038), "lengths_m"),
    (parameters.shapes_from_arcs, "arcs"),
    (lambda values: parameters.lengths_from_arcs(values, 0.038), "arcs"),
    (constant_curvature.section_inverse, "position_m"),
]


@pytest.mark.parametrize(("function", "name"), SHAPE_FUNCTIONS)
def test_a_nan_or_a_wrong_shape_is_refused_by_name(
    function: Callable[[np.ndarray], object], name: str
) -> None:
    good = np.full((2, 3), 0.2)
    function(good)
    with pytest.raises(InvalidInput, match=rf"{name}.*\[1.*nan"):
        function(with_value(good, (1, 1), NAN))
    with pytest.raises(InvalidInput, match=rf"{name} has the shape \(2, 2\)"):
        function(good[:, :2])


@pytest.mark.parametrize("offset_m", [0.0, -0.038, NAN, np.inf])
def test_a_chamber_offset_must_be_above_zero(offset_m: float) -> None:
    for function in (
        constant_curvature.shapes_from_lengths,
        constant_curvature.lengths_from_shapes,
        parameters.arcs_from_lengths,
    ):
        with pytest.raises(InvalidInput, match=rf"chamber_offset_m = {offset_m}: .*above 0"):
            function(np.full(3, 0.2), offset_m)
    with pytest.raises(InvalidInput, match="chamber_offset_m"):
        jacobians.shape_rates(offset_m)


@pytest.mark.parametrize("station", [-0.1, 3.1, NAN])
def test_a_station_lies_on_the_arm(station: float) -> None:
    for function in (jacobians.jacobians, jacobians.station_transforms):
        with pytest.raises(InvalidInput, match=rf"stations = {station}: .*between 0 and 3"):
            function(TRUNK, REST, station)


def test_names_are_checked() -> None:
    with pytest.raises(InvalidInput, match="over = 'angles': it must be one of lengths, shapes"):
        jacobians.jacobians(ARM, ARM.rest_lengths_m, over="angles")  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="seen_from = 'tip': it must be one of base, body"):
        jacobians.jacobians(ARM, ARM.rest_lengths_m, seen_from="tip")  # type: ignore[arg-type]
    for function in (parameters.in_frame, parameters.from_frame):
        with pytest.raises(InvalidInput, match="frame = 'x': it must be one of twist_free, paper"):
            function(np.eye(4), np.array([0.2, 0.1, 0.1]), "x")  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="frame = 'x'"):
        inverse.inverse(ARM, np.eye(4), "x")  # type: ignore[arg-type]


def test_batches_that_do_not_go_together_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"lengths_m \(2,\), stations \(3,\)"):
        jacobians.jacobians(TRUNK, np.stack([REST, REST]), np.zeros(3))


def test_a_curve_is_drawn_of_whatever_was_measured() -> None:
    outside = with_value(ARM.rest_lengths_m, (0, 1), 0.31)
    assert np.isfinite(constant_curvature.curve_transforms(ARM, outside, 5)).all()
    unknown = constant_curvature.curve_transforms(ARM, with_value(outside, (0, 1), NAN), 5)
    assert np.isnan(unknown[1:, :3, 3]).all()
    with pytest.raises(InvalidInput, match="points_per_section = 0"):
        constant_curvature.curve_transforms(ARM, outside, 0)
    with pytest.raises(InvalidInput, match=r"lengths_m has the shape \(3,\)"):
        constant_curvature.curve_transforms(ARM, outside[0], 5)

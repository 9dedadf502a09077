"""The published models against each other, and each one where it is known to fail."""

import numpy as np
import pytest

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from pneuarm.controllers.kinematics.models.allen import Allen
from pneuarm.controllers.kinematics.models.cosserat_rod import CosseratRod, three_springs
from pneuarm.controllers.kinematics.models.della_santina import DellaSantina, state_from_lengths
from pneuarm.controllers.kinematics.models.godage import Godage
from pneuarm.controllers.kinematics.models.jones_walker import JonesWalker
from pneuarm.controllers.kinematics.models.model import Model
from pneuarm.controllers.kinematics.models.paper import PaperEquation1, SingularityFree
from pneuarm.controllers.kinematics.models.webster_jones import WebsterJones
from tools.rig.arms import ARMS, paper_arm, random_lengths

#: Models that are the same arc, and how far (m) rounding and finite parts may take them from it.
ARCS = [
    (JonesWalker(units=10**6), 1e-11),
    (WebsterJones(), 1e-12),
    (Godage(31), 1e-13),
    (Allen(), 1e-14),
    (DellaSantina(), 1e-14),
    (PaperEquation1(), 1e-14),
    (SingularityFree(), 0.0),
]
SINGULAR = [JonesWalker(), WebsterJones(), PaperEquation1()]
REGULAR = [Godage(5), Allen(), DellaSantina(), SingularityFree()]
ROD = CosseratRod(three_springs(0.038, 1.0, 10.0))
EVERY = [*SINGULAR, *REGULAR, ROD]


def name(value: object) -> str | None:
    return getattr(value, "name", None)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize(("model", "tolerance"), ARCS, ids=name)
def test_the_models_of_constant_curvature_give_the_same_tip_frame(
    model: Model, tolerance: float, arm: Arm
) -> None:
    rng = np.random.default_rng(3)
    lengths = np.array([random_lengths(arm, rng) for _ in range(50)])
    ours = model.tip_transform(arm, lengths)
    np.testing.assert_allclose(ours, tip_transform(arm, lengths), rtol=0.0, atol=tolerance * 10)
    np.testing.assert_allclose(
        ours[:, :3, 3], tip_transform(arm, lengths)[:, :3, 3], rtol=0.0, atol=tolerance
    )


@pytest.mark.parametrize("model", SINGULAR, ids=name)
def test_the_singular_formulas_are_kept_singular_at_the_straight_arm(model: Model) -> None:
    assert np.isnan(model.tip_transform(paper_arm(), paper_arm().rest_lengths_m)[:2, 3]).all()


@pytest.mark.parametrize("model", REGULAR, ids=name)
def test_the_other_formulas_hold_at_the_straight_arm(model: Model) -> None:
    expected = np.eye(4)
    expected[2, 3] = 0.2
    tip = model.tip_transform(paper_arm(), paper_arm().rest_lengths_m)
    np.testing.assert_allclose(tip, expected, rtol=0.0, atol=1e-16)


@pytest.mark.parametrize("model", [JonesWalker(), WebsterJones()], ids=name)
def test_the_radicand_rounds_below_zero_a_millionth_of_a_millimetre_from_straight(
    model: Model,
) -> None:
    lengths = np.linspace(0.11, 0.29, 200)[:, None, None] + [[1e-9, 0.0, 0.0]]
    share = np.isnan(model.tip_transform(paper_arm(), lengths)[:, 0, 3]).mean()
    assert 0.05 < share < 0.95


@pytest.mark.parametrize("units", [1, 4, 10])
def test_straight_cables_between_plates_make_jones_and_walkers_arc_longer(units: int) -> None:
    lengths = np.array([[0.16, 0.2, 0.24]])
    theta = np.hypot(0.12 / (3 * 0.038), 0.04 / (np.sqrt(3.0) * 0.038))
    tip = JonesWalker(units).tip_transform(paper_arm(), lengths)
    turned = np.arccos(tip[2, 2])  # kappa s, with kappa = theta / L
    half = theta / (2.0 * units)
    assert turned / theta == pytest.approx(np.arcsin(half) / half, rel=1e-9)


def test_della_santinas_state_is_the_length_difference_along_x_and_y() -> None:
    state = state_from_lengths(paper_arm(), np.array([[0.17, 0.21, 0.25]]))
    # A chamber at (d, 0) would be shorter by delta_x: chamber 1 stands there.
    expected = [0.21 - 0.17, (0.25 - 0.21) / np.sqrt(3.0), 0.01]
    np.testing.assert_allclose(state[0], expected, atol=1e-15)


@pytest.mark.parametrize("order", range(1, 12))
def test_godages_error_is_the_first_power_of_the_bend_that_was_cut_off(order: int) -> None:
    theta = 0.5
    lengths = np.array([[0.2 - 0.038 * theta, 0.2 + 0.019 * theta, 0.2 + 0.019 * theta]])
    error = Godage(order).tip_transform(paper_arm(), lengths) - tip_transform(paper_arm(), lengths)
    cut = order + 1
    first_left_out = 0.2 * theta**cut / np.prod(np.arange(1.0, cut + 2))
    assert np.linalg.norm(error[:3, 3]) == pytest.approx(first_left_out, rel=0.1)


@pytest.mark.parametrize("order", range(1, 12))
def test_godages_rotation_keeps_no_power_above_its_order(order: int) -> None:
    theta = 0.5
    lengths = np.array([[0.2 - 0.038 * theta, 0.2 + 0.019 * theta, 0.2 + 0.019 * theta]])
    tip = Godage(order).tip_transform(paper_arm(), lengths)
    cut = order + 1 if order % 2 else order + 2  # the cosine has even powers only
    first_left_out = theta**cut / np.prod(np.arange(1.0, cut + 1))
    assert abs(tip[2, 2] - np.cos(theta)) == pytest.approx(first_left_out, rel=0.1)


def test_allens_series_is_the_form_that_it_stands_for() -> None:
    for theta in (1e-9, 1e-4, 0.00999, 0.01001):
        lengths = np.array([[0.2 - 0.038 * theta, 0.2 + 0.019 * theta, 0.2 + 0.019 * theta]])
        ours = Allen().tip_transform(paper_arm(), lengths)
        np.testing.assert_allclose(ours, tip_transform(paper_arm(), lengths), rtol=0.0, atol=3e-14)


@pytest.mark.parametrize("model", EVERY, ids=name)
def test_a_batch_is_its_members(model: Model) -> None:
    rng = np.random.default_rng(4)
    arm = paper_arm()
    batch = np.array([random_lengths(arm, rng) for _ in range(6)]).reshape(2, 3, 1, 3)
    tips = model.tip_transform(arm, batch)
    assert tips.shape == (2, 3, 4, 4)
    for index in np.ndindex(2, 3):
        np.testing.assert_allclose(
            tips[index], model.tip_transform(arm, batch[index]), rtol=0.0, atol=1e-12
        )


@pytest.mark.parametrize("model", EVERY, ids=name)
@pytest.mark.parametrize(
    ("lengths", "text"),
    [
        (np.full((2, 3), 0.2), r"lengths_m has the shape \(2, 3\).*1, 3\)"),
        (np.full(3, 0.2), r"lengths_m has the shape \(3,\)"),
        ([[[0.2, 0.2, 0.2]], [[0.2, np.nan, 0.2]]], r"lengths_m\[1, 0, 1\] = nan"),
        ([[0.2, 0.2, -0.1]], r"lengths_m\[0, 2\] = -0.1"),
        ([[0.2, np.inf, 0.2]], r"lengths_m\[0, 1\] = inf"),
    ],
)
def test_wrong_lengths_are_refused_with_their_place(
    model: Model, lengths: object, text: str
) -> None:
    with pytest.raises(InvalidInput, match=text):
        model.tip_transform(paper_arm(), np.asarray(lengths))


def test_models_refuse_to_be_made_with_less_than_one_unit_or_order() -> None:
    with pytest.raises(InvalidInput, match="units = 0"):
        JonesWalker(units=0)
    with pytest.raises(InvalidInput, match="order = 0"):
        Godage(0)

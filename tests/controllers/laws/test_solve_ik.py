"""The QP as it is built, and OSQP's answer against an independent solver."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from pneuarm.controllers.actuation.pressure_map import length_bounds_m
from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.kinematics.compiled import CompiledKinematics
from pneuarm.controllers.laws.solve_ik import DAMPING, IkBuilder, IkProblem, IkSolver
from pneuarm.controllers.limits.bend import BendLimit
from pneuarm.controllers.limits.length import LengthLimit
from pneuarm.controllers.limits.limits import Limits
from pneuarm.controllers.targets.targets import PARTS
from pneuarm.controllers.targets.twist import TwistTarget
from pneuarm.controllers.tasks.wanted import Wanted
from tools.rig.arms import ARMS, paper_arm, random_lengths

DT_S = 0.005
ARRAYS = ("P_upper", "q", "A_data", "lower", "upper", "jacobian", "rate", "base", "free", "checks")


class Bench:
    """An arm with its limits, its solver and random problems; the rows are units of steps."""

    def __init__(self, arm: Arm) -> None:
        self.arm, self.limits = arm, Limits(arm)
        self.builder = IkBuilder(arm, self.limits, whole=True)
        self.lengths, self.rates = np.zeros(arm.n_chambers), np.zeros(arm.n_chambers)
        self.wanted, self.dt_s = Wanted(arm.n_chambers, PARTS), np.full(1, DT_S)
        self.builder.function.bind([self.lengths, self.rates, self.wanted.values, self.dt_s])
        self.solver = IkSolver(arm.n_chambers, self.builder.pattern)
        self.kinematics = CompiledKinematics(arm)

    def build(self, lengths: Array, velocity_m_s: Array, gain_per_s: float = 30.0) -> IkProblem:
        self.lengths[:] = lengths.reshape(-1)
        TwistTarget(velocity_m_s, None, False, False).ask(self.wanted, gain_per_s, 1.0)
        self.wanted["posture_weight"] = 0.0
        self.builder.function.evaluate()
        problem = self.builder.problem
        return replace(problem, **{name: getattr(problem, name).copy() for name in ARRAYS})

    def problem(self, rng: np.random.Generator, speed_m_s: float = 0.1) -> IkProblem:
        lengths = random_lengths(self.arm, rng)
        if rng.random() < 0.5:  # at a bound
            lengths = Limits(self.arm).clip(lengths + 0.05 * rng.standard_normal(lengths.shape))
        return self.build(lengths, rng.uniform(0.0, 2.0 * speed_m_s) * rng.standard_normal(3))


def cost(problem: IkProblem, x: Array) -> float:
    return float(0.5 * x @ problem.P @ x + problem.q @ x)


def reference(problem: IkProblem) -> Array:
    """Solution by SLSQP, started in the middle."""
    bounded = np.isfinite(problem.lower)
    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: problem.upper - problem.A @ x,
            "jac": lambda x: -problem.A,
        },
        {
            "type": "ineq",
            "fun": lambda x: (problem.A @ x - problem.lower)[bounded],
            "jac": lambda x: problem.A[bounded],
        },
    ]
    result = minimize(
        lambda x: cost(problem, x),
        np.zeros(problem.q.size),
        jac=lambda x: problem.P @ x + problem.q,
        constraints=constraints,
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return result.x


def infeasible(problem: IkProblem) -> IkProblem:
    """Ask the first chamber to go beyond 2 and below 1 at once, as the solver sees it."""
    matrix, lower, upper = problem.A, problem.lower.copy(), problem.upper.copy()
    lower[0], upper[0] = 2.0, 3.0
    row = matrix.shape[0] - 1  # a bend: the sum of what it takes is bounded from above
    lower[: problem.q.size], upper[: problem.q.size] = 50.0, 60.0
    upper[row] = -1e4
    return replace(problem, lower=lower, upper=upper, checks=np.array([1.0, 0.0, 0.0]))


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_cost_is_the_task_and_the_damping_in_scaled_steps(arm: Arm) -> None:
    bench, rng = Bench(arm), np.random.default_rng(0)
    lengths, velocity = random_lengths(arm, rng), rng.standard_normal(3)
    problem = bench.build(lengths, velocity)
    jacobian = bench.kinematics.evaluate(lengths).jacobian[:3]
    step_m = arm.per_chamber("length_rate_max_m_s").reshape(-1) * DT_S
    x = rng.standard_normal(arm.n_chambers)
    miss = (jacobian @ (step_m * x) - velocity * DT_S) / step_m.max()
    constant = 0.5 * (velocity @ velocity) * (DT_S / step_m.max()) ** 2
    expected = 0.5 * miss @ miss + 0.5 * DAMPING * x @ x
    assert cost(problem, x) + constant == pytest.approx(expected)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_a_step_to_a_row_approaches_its_bound_as_a_target_on_it(arm: Arm) -> None:
    """What is left of a bound shrinks by gain times dt, to first order and but for the margin."""
    gain_per_s, share = 30.0, 30.0 * DT_S
    bench, rng = Bench(arm), np.random.default_rng(1)
    lengths = random_lengths(arm, rng, 0.9)
    problem = bench.build(lengths, np.zeros(3), gain_per_s)
    step_m = arm.per_chamber("length_rate_max_m_s").reshape(-1) * DT_S
    n = arm.n_chambers
    low, high = length_bounds_m(arm)
    before = np.concatenate([(lengths - low).reshape(-1), (high - lengths).reshape(-1)])
    margin_m = LengthLimit.margin_m
    for x, left, sign in (
        (problem.lower[:n], before[:n], 1.0),
        (problem.upper[:n], before[n:], -1),
    ):
        after = left + sign * step_m * x
        # The pressure may be tighter than the length, never wider.
        assert (after >= left - share * (left - margin_m) - 1e-12).all()
    bend = BendLimit(arm)
    for section in range(arm.n_sections):
        row, upper = problem.A[n + section], problem.upper[n + section]
        size = 1e-4
        moved = lengths + (size * step_m * row / (row @ row)).reshape(lengths.shape)
        slack, nearer = (bend.left_m(each).copy() for each in (lengths, moved))
        left = slack[section] - bend.margin_m
        if slack[section] < 0.9 * (slack + 1.0)[section] and left > 1e-3:
            assert (slack - nearer)[section] / size * upper == pytest.approx(share * left, rel=1e-2)


def test_the_violation_is_the_distance_to_the_worst_row() -> None:
    problem = Bench(paper_arm()).problem(np.random.default_rng(3))
    beyond = np.array([problem.upper[0] + 0.25, 0.0, 0.0])
    assert problem.violation(beyond) >= 0.25
    assert problem.violation(np.zeros(3)) <= 1e-2


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_step_is_the_one_that_another_solver_finds(arm: Arm) -> None:
    bench = Bench(arm)
    rng = np.random.default_rng(4)
    for _ in range(40):
        problem = bench.problem(rng, 0.4)
        x = bench.solver.solve(problem)
        assert x is not None
        assert problem.violation(x) <= 1e-3
        expected = reference(problem)
        np.testing.assert_allclose(x, expected, atol=2e-2)  # where the cost hardly changes
        assert cost(problem, x) <= cost(problem, expected) + 1e-3 * (1.0 + abs(cost(problem, x)))
    assert 5 <= bench.solver.asked <= 39  # both kinds were there: held by a row, and free


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_without_a_row_in_the_way_osqp_finds_the_same_as_no_solver_at_all(arm: Arm) -> None:
    bench, rng = Bench(arm), np.random.default_rng(9)
    free = [p for p in (bench.problem(rng, 0.02) for _ in range(40)) if p.checks[0] <= 0.0]
    assert len(free) > 5
    for problem in free:
        asked = replace(problem, checks=np.array([1.0, 0.0, 1.0]))
        np.testing.assert_array_equal(bench.solver.solve(problem), problem.free)
        np.testing.assert_allclose(bench.solver.solve(asked), problem.free, atol=5e-3)


def test_a_nan_gives_nothing_and_the_next_answer_is_right_again() -> None:
    rng = np.random.default_rng(5)
    bench, fresh = Bench(paper_arm()), Bench(paper_arm())
    for poison in (np.array([0.1, np.nan, 0.1]), np.full(3, np.inf)):
        lengths = random_lengths(paper_arm(), rng)
        assert bench.solver.solve(bench.build(lengths, poison)) is None
        problem = bench.problem(rng)
        after = bench.solver.solve(problem)
        np.testing.assert_allclose(after, fresh.solver.solve(problem), atol=1e-3)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_an_infeasible_problem_gives_nothing_and_the_next_answer_is_right_again(arm: Arm) -> None:
    rng = np.random.default_rng(6)
    bench = Bench(arm)
    for _ in range(3):
        problem = bench.problem(rng)
        assert bench.solver.solve(infeasible(problem)) is None
        x = bench.solver.solve(problem)
        assert x is not None
        np.testing.assert_allclose(x, reference(problem), atol=5e-3)


def test_a_result_counts_only_if_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(paper_arm())
    problem = replace(bench.problem(np.random.default_rng(7)), checks=np.array([1.0, 0.0, 0.0]))
    assert bench.solver.solve(problem) is not None
    monkeypatch.setattr(bench.solver, "_solved", -1)
    assert bench.solver.solve(problem) is None


def test_nothing_in_the_solver_depends_on_how_long_it_takes() -> None:
    """Adaptation of rho and the time limit would; two equal runs need not show it."""
    solver = Bench(paper_arm()).solver._solver
    assert not solver.get_settings().adaptive_rho
    assert solver.get_settings().time_limit >= 1e3


def test_the_same_problems_in_the_same_order_give_the_same_bits() -> None:
    answers = []
    for _ in range(2):
        bench, rng = Bench(ARMS["trunk"]), np.random.default_rng(8)
        answers.append([bench.solver.solve(bench.problem(rng)) for _ in range(30)])
    for first, second in zip(*answers, strict=True):
        np.testing.assert_array_equal(first, second)

"""The QP as it is built, and OSQP's answer against an independent solver."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from controllers.arm import Arm, Array
from controllers.kinematics.compiled import CompiledKinematics
from controllers.law import Limits
from controllers.limits.limit import Limit
from controllers.solve_ik import ACCEPTED_VIOLATION, DAMPING, IkProblem, IkSolver, build_ik
from tests.arms import ARMS, paper_arm, random_lengths

DT_S = 0.005


class Bench:
    """An arm with its limits, its solver and random problems."""

    def __init__(self, arm: Arm) -> None:
        limits = Limits(arm)
        self.arm = arm
        self.rows: tuple[Limit, ...] = (limits.length, limits.rate, limits.bend)
        self.largest_m = limits.rate.rate_max_m_s * DT_S
        self.solver = IkSolver(arm.n_chambers, self.rows)
        self._kinematics = CompiledKinematics(arm)

    def problem(self, rng: np.random.Generator, speed_m_s: float = 0.1) -> IkProblem:
        lengths = random_lengths(self.arm, rng)
        if rng.random() < 0.3:  # at a bound
            lengths = Limits(self.arm).clip(lengths + 0.05 * rng.standard_normal(lengths.shape))
        jacobian = self._kinematics.evaluate(lengths).jacobian[:3]
        rate = rng.uniform(0.0, 2.0 * speed_m_s) * rng.standard_normal(3)
        return build_ik(rate, jacobian, self.rows, lengths, self.largest_m, DT_S)


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
    """Ask the first chamber to step by at least 2, which its rate row forbids."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[0], upper[0] = 2.0, 3.0
    return replace(problem, lower=lower, upper=upper)


def test_the_cost_is_the_task_and_the_damping_in_scaled_steps() -> None:
    bench = Bench(paper_arm())
    lengths = paper_arm().rest_lengths_m
    rng = np.random.default_rng(0)
    jacobian, rate = rng.standard_normal((3, 3)), rng.standard_normal(3)
    step_m = np.array([1e-3, 2e-3, 0.5e-3])
    problem = build_ik(rate, jacobian, bench.rows, lengths, step_m, DT_S)
    x = rng.standard_normal(3)
    miss = (jacobian @ (step_m * x) - rate * DT_S) / step_m.max()
    constant = 0.5 * (rate * DT_S / step_m.max()) @ (rate * DT_S / step_m.max())
    assert cost(problem, x) + constant == pytest.approx(0.5 * miss @ miss + 0.5 * DAMPING * x @ x)


def test_the_rows_are_the_limits_in_units_of_the_largest_step() -> None:
    bench = Bench(paper_arm())
    lengths = random_lengths(paper_arm(), np.random.default_rng(1))
    step_m = np.array([1e-3, 2e-3, 0.5e-3])
    problem = build_ik(np.zeros(3), np.eye(3), bench.rows, lengths, step_m, DT_S)
    x = np.random.default_rng(2).standard_normal(3)
    blocks = [limit.rows(lengths, DT_S) for limit in bench.rows]
    in_metres = np.concatenate([rows @ (step_m * x) for rows, _, _ in blocks])
    np.testing.assert_allclose(problem.A @ x * step_m.max(), in_metres, atol=1e-17)
    lower = np.concatenate([lower for _, lower, _ in blocks])
    np.testing.assert_allclose(problem.lower * step_m.max(), lower)
    upper = np.concatenate([upper for _, _, upper in blocks])
    np.testing.assert_allclose(problem.upper * step_m.max(), upper)


def test_the_violation_is_the_distance_to_the_worst_row() -> None:
    problem = Bench(paper_arm()).problem(np.random.default_rng(3))
    beyond = np.array([problem.upper[3] + 0.25, 0.0, 0.0])
    assert problem.violation(beyond) >= 0.25
    assert problem.violation(-beyond) >= 0.25
    assert problem.violation(np.zeros(3)) <= 1e-12


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_step_is_the_one_that_another_solver_finds(arm: Arm) -> None:
    bench = Bench(arm)
    rng = np.random.default_rng(4)
    active = 0
    for _ in range(40):
        problem = bench.problem(rng)
        step = bench.solver.solve(problem)
        assert step is not None
        x = step / problem.step_m
        assert problem.violation(x) <= ACCEPTED_VIOLATION
        expected = reference(problem)
        np.testing.assert_allclose(x, expected, atol=5e-3)
        assert cost(problem, x) <= cost(problem, expected) + 1e-3 * (1.0 + abs(cost(problem, x)))
        rows = problem.A @ expected
        active += bool((np.minimum(problem.upper - rows, rows - problem.lower) < 1e-6).any())
    assert 5 <= active <= 39  # both kinds were there: held by a row, and free


def test_without_a_row_in_the_way_the_step_is_the_damped_least_squares() -> None:
    bench = Bench(paper_arm())
    lengths = paper_arm().rest_lengths_m
    jacobian = CompiledKinematics(paper_arm()).evaluate(lengths).jacobian[:3]
    rate = np.array([0.01, -0.02, 0.005])
    problem = build_ik(rate, jacobian, bench.rows, lengths, bench.largest_m, DT_S)
    expected = np.linalg.solve(jacobian.T @ jacobian + DAMPING * np.eye(3), jacobian.T @ rate)
    step = bench.solver.solve(problem)
    np.testing.assert_allclose(step, expected * DT_S, atol=1e-4 * bench.largest_m.max())


@pytest.mark.parametrize("field", ["q", "P", "A", "lower", "upper"])
def test_a_nan_anywhere_gives_nothing_and_the_next_answer_is_right_again(field: str) -> None:
    rng = np.random.default_rng(5)
    bench, fresh = Bench(paper_arm()), Bench(paper_arm())
    for _ in range(5):
        problem = bench.problem(rng)
        poisoned = getattr(problem, field).copy()
        poisoned.flat[0] = np.nan
        assert bench.solver.solve(replace(problem, **{field: poisoned})) is None
        after = bench.solver.solve(problem)
        np.testing.assert_allclose(after, fresh.solver.solve(problem), atol=1e-3 * 7.5e-4)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_an_infeasible_problem_gives_nothing_and_the_next_answer_is_right_again(arm: Arm) -> None:
    rng = np.random.default_rng(6)
    bench = Bench(arm)
    for _ in range(5):
        problem = bench.problem(rng)
        assert bench.solver.solve(infeasible(problem)) is None
        after = bench.solver.solve(problem)
        assert after is not None
        np.testing.assert_allclose(after / problem.step_m, reference(problem), atol=5e-3)


def test_a_rate_that_is_not_a_number_gives_nothing() -> None:
    bench = Bench(paper_arm())
    lengths = paper_arm().rest_lengths_m
    rate = np.array([0.1, np.nan, 0.1])
    problem = build_ik(rate, np.eye(3), bench.rows, lengths, bench.largest_m, DT_S)
    assert bench.solver.solve(problem) is None


@pytest.mark.parametrize("field", ["x beyond the rows", "status"])
def test_a_result_counts_only_if_solved_and_within_its_rows(
    field: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(paper_arm())
    problem = bench.problem(np.random.default_rng(7))
    assert bench.solver.solve(problem) is not None
    if field == "status":
        monkeypatch.setattr(bench.solver, "_solved", -1)
    else:
        monkeypatch.setattr(IkProblem, "violation", lambda self, x: 2.0 * ACCEPTED_VIOLATION)
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

"""The loaded chain at rest: where it hangs, how it swings about that, how stiff it has to be."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Array
from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.simulator.chain import Chain

#: Newton's method: no bending component moves further than this in one step (rad).
_LARGEST_STEP_RAD = 0.2
_NEWTON_STEPS = 60
#: Beyond this an equilibrium is none of an arm: the equations even turn a soft one inside out.
LARGEST_STRAIN = 0.5
#: Generalised forces (N and N m) below this share of the arm's largest stiffness are rest.
_REST = 1e-12
#: Half step of the central difference of gravity's force (m and rad).
_DIFFERENCE = 1e-5
#: The search for a stiffness: doublings or halvings, then steps of the false position.
_BRACKET_STEPS = 20
_SEARCH_STEPS = 60
_MODE_TOLERANCE = 1e-6
#: First frequency of a clamped beam over sqrt(EI / (m L^3)): where the search for EI starts.
_BEAM_FREQUENCY = 3.516


def too_soft() -> InvalidInput:
    """Return what is said of an arm for which no rest is found."""
    return InvalidInput(
        "the simulated arm is too soft to hold itself: its own weight changes its length by more "
        f"than {LARGEST_STRAIN:.0%}, or it finds no rest; raise lowest_mode_hz"
    )


def no_stiffness(mode_hz: float) -> InvalidInput:
    """Return what is said of a mode that no arm has."""
    return InvalidInput(
        f"lowest_mode_hz = {mode_hz:g}: no stiffness gives the simulated arm this mode; "
        "1.5 to 3 Hz is what it is made for"
    )


def beam_stiffness(mass_kg: float, length_m: float, mode_hz: float) -> float:
    """Bending stiffness EI (N m^2) with which a clamped beam has the mode: a guess for an arm's."""
    return mass_kg * length_m**3 * (2.0 * np.pi * mode_hz / _BEAM_FREQUENCY) ** 2


def swing(
    square: float, mode: Array, stiffness: Array, damping_ratio: float
) -> tuple[float, float]:
    """Lowest mode (Hz) and the time (s) by which stiffness gives damping of the wanted ratio.

    ``square`` (rad^2/s^2) and ``mode`` (n,), mass-normalised, are the mode's, ``stiffness`` (n,)
    the springs'. Raises InvalidInput for a mode that is none: the arm falls.
    """
    if square <= 0.0:
        raise InvalidInput(
            f"the drawn simulated arm falls over under its gravity (squared frequency {square:g} "
            "rad^2/s^2, which must be above 0): raise lowest_mode_hz"
        )
    frequency = np.sqrt(square)
    damping_time_s = 2.0 * damping_ratio * frequency / (stiffness @ mode**2)
    return float(frequency / (2.0 * np.pi)), float(damping_time_s)


@dataclass(frozen=True)
class LoadedChain:
    """A chain with its ``weights`` (6 n,), diagonal ``stiffness`` (3 n,) and ``rest`` (3 n,).

    Stiffness in N/m for a length and N m/rad for a bend; rest is the shape without any load.
    """

    chain: Chain
    weights: Array
    stiffness: Array
    rest: Array

    def gravity_force(self, shapes: Array) -> Array:
        """Generalised force of gravity (3 n,) at the shapes (3 n,)."""
        jacobian, fall = self.chain.dynamics(shapes, np.zeros_like(shapes), self.weights)
        force: Array = jacobian @ fall
        return force

    def stiffness_matrix(self, shapes: Array) -> Array:
        """Elastic and gravity's stiffness (3 n, 3 n), symmetric, at the shapes (3 n,)."""
        columns = []
        for step in _DIFFERENCE * np.eye(shapes.size):
            change = self.gravity_force(shapes + step) - self.gravity_force(shapes - step)
            columns.append(change / (2.0 * _DIFFERENCE))
        gravity = np.array(columns)
        return np.diag(self.stiffness) - 0.5 * (gravity + gravity.T)

    def mass_matrix(self, shapes: Array) -> Array:
        """Mass matrix (3 n, 3 n) at the shapes (3 n,)."""
        jacobian, _ = self.chain.dynamics(shapes, np.zeros_like(shapes), self.weights)
        mass: Array = jacobian @ jacobian.T
        return mass


def equilibrium(loaded: LoadedChain) -> Array:
    """Shapes (3 n,) of the vented arm at rest under its gravity, found from the straight arm.

    Raises InvalidInput when there is none to be found: the arm is too soft to hold itself.
    """
    shapes = loaded.rest.copy()
    for _ in range(_NEWTON_STEPS):
        force = loaded.gravity_force(shapes) - loaded.stiffness * (shapes - loaded.rest)
        if np.abs(force).max() < _REST * loaded.stiffness.max():
            return shapes
        step = np.linalg.solve(loaded.stiffness_matrix(shapes), force)
        shapes = shapes + step * min(1.0, _LARGEST_STEP_RAD / np.abs(step).max())
        if np.abs(shapes[::3] / loaded.rest[::3] - 1.0).max() > LARGEST_STRAIN:
            break
    raise too_soft()


def lowest_mode(loaded: LoadedChain, shapes: Array) -> tuple[float, Array]:
    """Square of the lowest natural frequency (rad^2/s^2) and its shape (3 n,), mass-normalised.

    The square is negative where the arm would fall away from the shapes.
    """
    half = np.linalg.inv(np.linalg.cholesky(loaded.mass_matrix(shapes)))
    squares, vectors = np.linalg.eigh(half @ loaded.stiffness_matrix(shapes) @ half.T)
    return float(squares[0]), half.T @ vectors[:, 0]


def stiffness_for_mode(
    of_stiffness: Callable[[float], LoadedChain], mode_hz: float, guess: float
) -> float:
    """Bending stiffness EI (N m^2) with which the lowest mode at rest is ``mode_hz``.

    The frequency grows with EI, so the root is bracketed from the ``guess`` and then closed in
    upon by the false position (Illinois). Raises InvalidInput when no stiffness gives that mode.
    """

    def excess(bending: float) -> float:
        return _square_at_rest(of_stiffness(bending)) / (2.0 * np.pi * mode_hz) ** 2 - 1.0

    low, low_excess = guess, excess(guess)
    factor = 0.5 if low_excess > 0.0 else 2.0
    for _ in range(_BRACKET_STEPS):
        high, high_excess = low * factor, excess(low * factor)
        if low_excess * high_excess <= 0.0:
            found = _false_position(excess, (low, low_excess), (high, high_excess))
            if found is not None:
                return found
            break
        low, low_excess = high, high_excess
    raise no_stiffness(mode_hz)


def _square_at_rest(loaded: LoadedChain) -> float:
    """Square of the lowest frequency at rest (rad^2/s^2); zero for an arm that finds no rest."""
    try:
        return lowest_mode(loaded, equilibrium(loaded))[0]
    except InvalidInput:
        return 0.0


def _false_position(
    function: Callable[[float], float], near: tuple[float, float], far: tuple[float, float]
) -> float | None:
    """Root between two points ``(x, f(x))`` of opposite sign, by the Illinois method.

    None where the sign changes by a jump.
    """
    for _ in range(_SEARCH_STEPS):
        x = (near[0] * far[1] - far[0] * near[1]) / (far[1] - near[1])
        value = function(x)
        if abs(value) < _MODE_TOLERANCE:
            return x
        # A point that stays counts half, or it would stay for ever.
        far = near if value * near[1] < 0.0 else (far[0], 0.5 * far[1])
        near = (x, value)
    return None

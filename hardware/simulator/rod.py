"""The lumped rod: the arm's body, driven by the lengthening of its chambers.

Pressure acts along the whole chamber, walls too, so it is a bending moment and an axial force
constant along the arc. Without gravity a section therefore rests in an arc; with it, it does not.
"""

from dataclasses import replace

import numpy as np
from scipy.linalg.lapack import dposv

from pneuarm.controllers.arm.arm import CHAMBER_ANGLES_RAD, Arm, Array
from pneuarm.hardware.simulator.chain import Chain
from pneuarm.hardware.simulator.parameters import DrawnParameters, SimulatorParameters
from pneuarm.hardware.simulator.statics import (
    LoadedChain,
    beam_stiffness,
    equilibrium,
    lowest_mode,
    stiffness_for_mode,
    swing,
)


class Rod:
    """Shapes (3 n,) of ``n`` sub-segments and their rates, stepped in time.

    ``lowest_mode_hz`` is the drawn arm's own, at rest under its gravity. Raises InvalidInput for
    an arm that cannot hold itself.
    """

    def __init__(self, arm: Arm, drawn: DrawnParameters) -> None:
        chain = Chain(arm.n_sections * drawn.values.segments_per_section, arm.gravity_m_s2)
        nominal = _nominal_chain(arm, chain, drawn.nominal)
        bending = nominal.stiffness[1] * nominal.rest[0]
        factors = np.array(drawn.stiffness_factors)
        self.loaded = _loaded_chain(arm, chain, drawn.values, bending * factors)
        self._equilibrium = equilibrium(self.loaded)
        self._force_per_lengthening = nominal.stiffness[:, None] * _shape_shift(
            arm, drawn.values.segments_per_section
        )
        self.lowest_mode_hz, self._damping_time_s = swing(
            *lowest_mode(self.loaded, self._equilibrium),
            self.loaded.stiffness,
            drawn.values.damping_ratio,
        )
        self._mass = np.zeros((chain.n_segments * 3,) * 2)
        self._mass_diagonal = self._mass.reshape(-1)[:: chain.n_segments * 3 + 1]
        self._elastic_rest = self.loaded.stiffness * self.loaded.rest
        self.reset()

    def reset(self) -> None:
        """Put the arm at rest: vented, hanging as its gravity has it."""
        self.shapes = self._equilibrium.copy()
        self.rates: Array = np.zeros_like(self.shapes)

    def step(self, lengthening_m: Array, step_s: float) -> None:
        """Advance by ``step_s`` under lengthenings (n_chambers,) of unloaded chambers.

        Implicit in elasticity and damping, so stable at any step for these, however stiff;
        explicit in gravity and the velocities' forces. Implicit Euler itself damps like half a
        step of stiffness, which is taken off the damping: the drawn ratio is what one sees.
        """
        loaded = self.loaded
        jacobian, imposed = loaded.chain.dynamics(self.shapes, self.rates, loaded.weights)
        force = self._force_per_lengthening @ lengthening_m
        force += self._elastic_rest - loaded.stiffness * self.shapes
        impulse = jacobian @ (self.rates @ jacobian + step_s * imposed) + step_s * force
        np.matmul(jacobian, jacobian.T, out=self._mass)
        damping_time_s = max(self._damping_time_s - 0.5 * step_s, 0.0)
        self._mass_diagonal += (step_s * (damping_time_s + step_s)) * loaded.stiffness
        # Symmetric and positive definite: Cholesky, without the checks that cost half the time.
        self.rates[:] = dposv(self._mass, impulse)[1]
        self.shapes = self.shapes + step_s * self.rates

    def tip(self) -> tuple[Array, Array]:
        """Tip position (3,) in m and twist-free rotation (3, 3), in the base frame; copies."""
        positions, rotation = self.loaded.chain.pose(self.shapes)
        return positions[-1].copy(), rotation.copy()


def _nominal_chain(arm: Arm, chain: Chain, nominal: SimulatorParameters) -> LoadedChain:
    """Return the chain of the nominal arm, as stiff as its lowest mode asks for."""
    length = arm.total_rest_length_m
    mass = nominal.mass_per_length_kg_m * length + 2.0 * nominal.plate_mass_kg
    guess = beam_stiffness(mass, length, nominal.lowest_mode_hz)
    straight = _loaded_chain(arm, chain, nominal, np.ones(arm.n_sections))

    def of_stiffness(bending: float) -> LoadedChain:
        return replace(straight, stiffness=bending * straight.stiffness)

    return of_stiffness(stiffness_for_mode(of_stiffness, nominal.lowest_mode_hz, guess))


def _loaded_chain(
    arm: Arm, chain: Chain, values: SimulatorParameters, bending_n_m2: Array
) -> LoadedChain:
    """Return the chain with the masses of the values and each section's bending stiffness EI."""
    pieces = values.segments_per_section
    masses = np.zeros(chain.n_segments + 1)
    stiffness, rest = [], []
    for index, section in enumerate(arm.sections):
        length = section.rest_length_m / pieces
        first, end = index * pieces, (index + 1) * pieces
        # Half of a sub-segment's mass goes to each of its ends; the base carries its own.
        masses[first:end] += 0.5 * values.mass_per_length_kg_m * length
        masses[first + 1 : end + 1] += 0.5 * values.mass_per_length_kg_m * length
        masses[end] += values.plate_mass_kg
        bend = bending_n_m2[index] / length
        axial = 2.0 * values.axial_stiffness_ratio * bend / section.chamber_offset_m**2
        stiffness += [axial, bend, bend] * pieces
        rest += [length, 0.0, 0.0] * pieces
    roots = np.repeat(np.sqrt(masses[1:]), 3)
    weights = np.concatenate([roots, values.gyration_radius_m * roots])
    return LoadedChain(chain, weights, np.array(stiffness), np.array(rest))


def _shape_shift(arm: Arm, pieces: int) -> Array:
    """Change of every sub-segment's rest shape over every chamber's lengthening.

    Shape (3 n, n_chambers): each sub-segment takes its even part of what constant curvature
    gives its section.
    """
    shift = np.zeros((3 * pieces * arm.n_sections, arm.n_chambers))
    for index, section in enumerate(arm.sections):
        over_offset = -2.0 / (3.0 * section.chamber_offset_m)
        whole = np.array(
            [
                np.full(3, 1.0 / 3.0),
                over_offset * np.cos(CHAMBER_ANGLES_RAD),
                over_offset * np.sin(CHAMBER_ANGLES_RAD),
            ]
        )
        rows = slice(3 * pieces * index, 3 * pieces * (index + 1))
        shift[rows, 3 * index : 3 * index + 3] = np.tile(whole / pieces, (pieces, 1))
    return shift

"""The motion of a calibration: a gentle part, every chamber alone, in pairs, all together, steps.

A plan is a list of moves: ramp to some pressures, then rest there. The gentle part comes first, in
steps so small that no monitor minds them whatever the valves are; what they answer says at what
pace the rest may go. Without vacuum the levels are those above zero only. The moves of several
sections follow one another, with the other sections vented, and then all of them move together.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.calibration.pace import Pace
from pneuarm.controllers.calibration.recording import AVERAGED_S, SETTLED_PA, settled
from pneuarm.controllers.kinematics.constant_curvature import shapes_from_lengths

#: Largest share of the pressure range that is used.
LARGEST_SHARE = 0.7
RAMP_S = 0.7
REST_S = 0.95
STEP_REST_S = 2.3
#: A rest goes on until pressures and tip have settled, and at most so long (s).
LONGEST_REST_S = 12.0

#: The gentle part goes up a staircase of so many steps, and down again. A step is this share of
#: what would be a fault, and its pressure has settled when it changes by less than this share of it
#: in so long (s), after a rest that is longer than any dead time.
_STAIRS, _STEP_OF_FAULT = 4, 0.8
_STANDS_SHARE, _STANDS_APART_S, _STAIR_REST_S = 0.05, 0.8, 1.6
#: Of the valves' slower lag: how far the means are apart that tell whether an arm has settled.
_APART_SHARE, _LONGEST_APART_S = 0.5, 1.5

#: Times (samples,), measured pressures (samples, ...) and measured tips (samples, 3) of the newest
#: so many seconds.
Newest = Callable[[float], tuple[Array, Array, Array]]

#: The pace of an arm whose valves are those that are expected.
KNOWN = Pace()

#: Of the largest bend of a section: what one chamber alone, or two, may bend it.
_BEND_SHARE = 0.75


@dataclass(frozen=True)
class Move:
    """Ramp to ``pressures_pa`` (n_sections, 3) in ``ramp_s``; then rest.

    The rest lasts ``rest_s`` and, where valves are slow, until the arm has settled: until the mean
    pressures of two times ``apart_s`` apart differ by less than ``settled_pa``. A ``ramp_s`` of 0
    is a step: as fast as the arm's limits allow. A ramp is smooth; a longer one than RAMP_S is for
    slow valves, which smooth it, and is even.
    """

    pressures_pa: Array
    ramp_s: float
    rest_s: float
    apart_s: float = AVERAGED_S
    settled_pa: float = SETTLED_PA

    @property
    def duration_s(self) -> float:
        """Time of the whole move, of an arm that settles in time."""
        return self.ramp_s + self.rest_s

    @property
    def longest_s(self) -> float:
        """Time after which it is over, settled or not."""
        return self.ramp_s + max(self.rest_s, LONGEST_REST_S)

    @property
    def looked_at_s(self) -> float:
        """How much of what was recorded last tells whether the arm has settled."""
        return AVERAGED_S + self.apart_s

    def at(self, start_pa: Array, elapsed_s: float) -> Array:
        """Pressures some time after the move began at ``start_pa``."""
        share = 1.0 if elapsed_s >= self.ramp_s else elapsed_s / self.ramp_s
        if self.ramp_s <= RAMP_S:  # of minimum jerk
            share = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        pressures: Array = start_pa + share * (self.pressures_pa - start_pa)
        return pressures

    def over(self, elapsed_s: float, newest: Newest) -> bool:
        """Whether it is over ``elapsed_s`` after it began; ``newest`` is asked once it matters."""
        if not self.duration_s <= elapsed_s < self.longest_s:
            return elapsed_s >= self.longest_s
        return settled(*newest(self.looked_at_s), self.apart_s, self.settled_pa)


_ALONE = (0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0)
_PAIR = (1.0, 0.4, -0.7)
_ALL = (0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5)
_MIXED = 12
_STEP_SHARE = 0.7
_STEPS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0))


def gentle(arm: Arm, fault_pa: float) -> list[Move]:
    """Steps up and down, of all chambers together, that show what the valves do.

    ``fault_pa`` is the smallest distance between pressures that somebody calls a fault.
    """
    highest_pa = float(arm.per_chamber("pressure_max_pa").min())
    step_pa = min(_STEP_OF_FAULT * fault_pa, LARGEST_SHARE * highest_pa / _STAIRS)
    stands_pa = _STANDS_SHARE * step_pa
    return [
        Move(
            np.full((arm.n_sections, 3), stair * step_pa),
            0.0,
            _STAIR_REST_S,
            _STANDS_APART_S,
            stands_pa,
        )
        for stair in (*range(1, _STAIRS + 1), *range(_STAIRS - 1, -1, -1))
    ]


def plan(arm: Arm, pace: Pace = KNOWN, seed: int = 0) -> list[Move]:
    """Return the moves, from the vented arm back to it; the same for the same arm and seed.

    The pace changes how they are made, and how large the steps are, not how many there are.
    """
    rng = np.random.default_rng(seed)
    shares: list[Array] = []
    for section in range(arm.n_sections):
        for pattern in _section_patterns():
            whole = np.zeros((arm.n_sections, 3))
            whole[section] = pattern
            shares.append(whole)
    mixed = _MIXED if arm.n_sections == 1 else 2 * _MIXED * arm.n_sections
    shares += list(rng.uniform(-0.9, 0.9, (mixed, arm.n_sections, 3)))
    shares.append(np.zeros((arm.n_sections, 3)))
    apart_s = min(max(AVERAGED_S, _APART_SHARE * pace.lag_s), _LONGEST_APART_S)
    moves, at_pa = list[Move](), np.zeros((arm.n_sections, 3))
    for share in _possible(arm, shares):
        there_pa = _pressures(arm, share)
        ramp_s = max(RAMP_S, pace.ramp_s(there_pa - at_pa))
        moves.append(Move(there_pa, ramp_s, REST_S, apart_s))
        at_pa = there_pa
    size = _STEP_SHARE / arm.n_sections  # the tip swings as far, whatever hangs from what
    for step in _STEPS:
        share = np.tile(size * np.array(step), (arm.n_sections, 1))
        there_pa = _pressures(arm, share)
        there_pa = there_pa * min(1.0, pace.step_pa / max(float(there_pa.max()), 1e-9))
        moves.append(Move(there_pa, 0.0, STEP_REST_S, apart_s))
    return moves


def _section_patterns() -> list[Array]:
    """Shares of the pressures of one section, one after the other."""
    units = np.eye(3)
    patterns = [level * units[chamber] for chamber in range(3) for level in _ALONE]
    patterns += [level * (1.0 - units[chamber]) for chamber in range(3) for level in _PAIR]
    patterns += [np.full(3, level) for level in _ALL]
    return patterns


def _possible(arm: Arm, shares: list[Array]) -> list[Array]:
    """Leave out what an arm without vacuum cannot do, and what would repeat the move before."""
    vacuum = arm.per_chamber("pressure_min_pa") < 0.0
    kept: list[Array] = []
    last = np.zeros((arm.n_sections, 3))
    for share in shares:
        possible = np.where(vacuum, share, np.abs(share))
        if not vacuum.any() and (share <= 0.0).all() and (share < 0.0).any():
            continue
        if not np.array_equal(possible, last) or not kept:
            kept.append(possible)
        last = possible
    return kept


def _pressures(arm: Arm, share: Array) -> Array:
    """Gauge pressures (n_sections, 3) for shares -1 to 1 of the range that is used."""
    high = LARGEST_SHARE * arm.per_chamber("pressure_max_pa")
    low = -LARGEST_SHARE * arm.per_chamber("pressure_min_pa")
    pressures: Array = np.where(share >= 0.0, share * high, share * low)
    return pressures * _bend_factor(arm, pressures)


def _bend_factor(arm: Arm, pressures_pa: Array) -> Array:
    """Factor (n_sections, 1) that keeps the bend of every section well inside its limit."""
    linear = arm.per_chamber("lengthening_m_per_pa")
    curve = linear + arm.per_chamber("softening_m_per_pa2") * np.abs(pressures_pa)
    lengths = arm.rest_lengths_m + curve * pressures_pa
    shapes = shapes_from_lengths(lengths, arm.per_section("chamber_offset_m"))
    bend = np.hypot(shapes[:, 1], shapes[:, 2])[:, None]
    allowed = _BEND_SHARE * arm.per_section("bend_max_rad")
    factor: Array = np.minimum(1.0, allowed / np.maximum(bend, 1e-9))
    return factor


def duration_s(moves: list[Move]) -> float:
    """Time of a whole plan."""
    return sum(move.duration_s for move in moves)

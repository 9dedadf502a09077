"""Recordings of arms that obey the calibrated map exactly, for the tests of the calibration."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneuarm.controllers.actuation.pressure_map import PressureMap
from pneuarm.controllers.arm.arm import Arm, Array, Response
from pneuarm.controllers.calibration.hysteresis import play_outputs
from pneuarm.controllers.calibration.plan import Move, plan
from pneuarm.controllers.calibration.recording import Recording
from pneuarm.controllers.kinematics.constant_curvature import tip_transform
from tools.rig.arms import paper_arm, table1_arm
from tools.rig.foreign_arms import sent_by

SAMPLE_S = 0.01
#: Valves and mode of an arm that differs from its nominal self.
TRUE_RESPONSE = Response(
    delay_s=0.02, filling_lag_s=0.09, exhausting_lag_s=0.15, mode_hz=1.7, damping_ratio=0.2
)
#: Where nothing swings, so many samples are enough.
COARSE_S = 0.05


def other_arm(arm: Arm) -> Arm:
    """An arm that differs from its nominal self in everything that is fitted."""
    sections = tuple(
        replace(
            section,
            rest_length_m=1.02 * section.rest_length_m,
            chamber_offset_m=0.93 * section.chamber_offset_m,
            lengthening_m_per_pa=1.15 * section.lengthening_m_per_pa,
            softening_m_per_pa2=0.7 * section.softening_m_per_pa2,
            coupling=((1.03, 0.02, -0.03), (-0.01, 0.96, 0.02), (0.03, -0.03, 1.01)),
            hysteresis_pa=0.01 * (section.pressure_max_pa - section.pressure_min_pa),
            bending_compliance_rad_per_n_m=0.8,
            axial_compliance_m_per_n=1e-3,
        )
        for section in arm.sections
    )
    return replace(arm, sections=sections, response=TRUE_RESPONSE)


def quiet(arm: Arm, moves: Sequence[Move]) -> Recording:
    """What would be recorded of an arm whose valves do not lag and whose tip does not swing."""
    sent_pa = sent_by(moves, arm.n_sections, COARSE_S)
    return recording_of(arm, sent_pa, swings=False, sample_s=COARSE_S)


def recording_of(
    arm: Arm, sent_pa: Array, swings: bool = True, sample_s: float = SAMPLE_S
) -> Recording:
    """What would be recorded of ``arm``: its valves lag, its tip swings, its chambers play."""
    rng = np.random.default_rng(0)
    response = arm.response
    time_s = sample_s * np.arange(len(sent_pa))
    lagged = delayed_and_lagged(sent_pa, response) if swings else sent_pa
    acting, _ = play_outputs(lagged, arm.per_section("hysteresis_pa"))
    pressure_map, lengths = PressureMap(arm), np.empty_like(acting)
    near = None
    for index, pressures in enumerate(acting):
        near = lengths[index] = pressure_map.lengths_m(pressures, near)
    transforms = np.array([tip_transform(arm, row) for row in lengths])
    tips, rotations = transforms[:, :3, 3], transforms[:, :3, :3]
    if swings:
        tips = swung(tips, response)
    noise = rng.normal(0.0, 1.0, tips.shape)
    measured = lagged + 100.0 * rng.normal(0.0, 1.0, sent_pa.shape)
    return Recording(time_s, sent_pa, measured, tips + 1e-5 * noise, rotations)


def delayed_and_lagged(sent_pa: Array, response: Response, finer: int = 20) -> Array:
    """Euler's method at a twentieth of a sample: no formula of the code under test."""
    step_s = SAMPLE_S / finer
    fine = (
        np.repeat(np.arange(len(sent_pa)), finer) + np.tile(np.arange(finer), len(sent_pa)) / finer
    )
    flat = sent_pa.reshape(len(sent_pa), -1)
    times = np.maximum(fine * SAMPLE_S - response.delay_s, 0.0) / SAMPLE_S
    columns = [np.interp(times, np.arange(len(flat)), column) for column in flat.T]
    inputs, state, out = np.stack(columns, axis=1), flat[0].copy(), []
    for index, entering in enumerate(inputs):
        if index % finer == 0:
            out.append(state.copy())
        lags_s = np.where(entering > state, response.filling_lag_s, response.exhausting_lag_s)
        state += step_s / lags_s * (entering - state)
    return np.array(out).reshape(sent_pa.shape)


def swung(tips_m: Array, response: Response, finer: int = 20) -> Array:
    """Tips of an oscillator, by the semi-implicit Euler method."""
    omega, step_s = 2.0 * np.pi * response.mode_hz, SAMPLE_S / finer
    position, speed, out = tips_m[0].copy(), np.zeros(3), []
    for tip in tips_m:
        out.append(position.copy())
        for _ in range(finer):
            pull = omega**2 * (tip - position) - 2.0 * response.damping_ratio * omega * speed
            speed += step_s * pull
            position = position + step_s * speed
    return np.array(out)


def short_plan(arm: Arm) -> list[Move]:
    """The plan without what would only take time here."""
    return [Move(move.pressures_pa, 0.1 if move.ramp_s else 0.0, move.rest_s) for move in plan(arm)]


PAPER, TABLE1 = paper_arm(), table1_arm()

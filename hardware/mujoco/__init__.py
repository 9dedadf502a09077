"""The simulated arm in MuJoCo: a second body, with twist and contact. Needs `pneuarm[mujoco]`."""

"""The simulated arm: a lumped rod with valves, not the controller's constant curvature."""

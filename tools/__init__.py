"""Tools for whoever works on the project: benchmarks, the fault campaign, the validation."""

"""The correction by a measured tip, and the estimate of what was not measured."""

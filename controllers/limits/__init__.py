"""Limits: what no step may exceed, as rows of ``lower <= G dq <= upper``."""

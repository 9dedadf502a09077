"""Limits: what no commanded lengths may exceed, each as what is left of it."""

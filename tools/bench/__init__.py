"""Benchmarks: run by hand or by make, each prints its figures."""

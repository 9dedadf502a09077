"""Monitors: a file each, with its fault, its keys and how it looks. Pure; time is an argument."""

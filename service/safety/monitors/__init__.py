"""Monitors: each looks for one fault, with a threshold and a persistence. Pure; time passed in."""

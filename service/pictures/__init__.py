"""Matplotlib, for the pictures of workspace and calibration; loaded late, and missed in words."""

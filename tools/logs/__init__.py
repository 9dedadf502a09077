"""Logs on which something is tried."""

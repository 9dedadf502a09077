"""Zenoh sessions as this project opens them: loopback, no scouting."""

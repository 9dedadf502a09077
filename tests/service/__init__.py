"""Tests of the daemon, mirroring service/."""

"""The tests, mirroring the packages. No test depends on how fast the machine is."""

from hypothesis import settings

settings.register_profile("pneuarm", deadline=None)
settings.load_profile("pneuarm")

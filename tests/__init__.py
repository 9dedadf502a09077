"""The tests, mirroring the packages. No test depends on how fast the machine is.

Where CI is set the examples are the same in every run, so that what passed once passes again; on a
developer's machine they are new ones each time.
"""

import os

from hypothesis import settings

settings.register_profile("pneuarm", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("pneuarm")

"""Another wall clock for every Python process that starts with this folder on its PYTHONPATH.

Python imports a module of this name by itself when it starts. `time.time` and `time.time_ns` then
add the offset (ns) that the file named in PNEUARM_FAULT_CLOCK holds, and nothing of the daemon
needs to know. The monotonic clock stays as it is: the kernel lets nobody set that.
"""

import mmap
import os
import struct
import time

with open(os.environ["PNEUARM_FAULT_CLOCK"], "rb") as file:
    _offset = mmap.mmap(file.fileno(), 8, prot=mmap.PROT_READ)
_time_ns = time.time_ns


def _shifted_ns() -> int:
    """Return the time since 1970 as this machine's clock would show it, ns."""
    return int(_time_ns() + struct.unpack("<q", _offset)[0])


time.time_ns = _shifted_ns
time.time = lambda: _shifted_ns() * 1e-9

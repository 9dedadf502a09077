"""Faults of a serial transport, by words: those of every transport that a cable can have."""

import random

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.hardware.transports.transport_faults import TransportFaults

#: ``garbage``: the next answer is noise; ``half-lines S``: bytes are lost for S seconds.
SERIAL_WORDS = ("silence S", "slow MS", "unplug S", "reset", "garbage", "half-lines S")
_NO_SERIAL_WORDS = ("exception", "wrong")

#: Share of the bytes that half lines lose.
_LOST_SHARE = 0.05


class SerialFaults(TransportFaults):
    """What happens to the bytes between an emulated device and its host."""

    def __init__(self) -> None:
        super().__init__()
        self._half_lines_until_s = -1.0
        self._random = random.Random(0)

    def inject(self, words: str, now_s: float) -> bool:
        """Take one line; return whether it is a fault of the transport. Raises InvalidInput."""
        name, *values = words.split() or [""]
        if name in _NO_SERIAL_WORDS:
            raise InvalidInput(f"fault {words!r}: a serial device has {', '.join(SERIAL_WORDS)}")
        if name != "half-lines":
            return super().inject(words, now_s)
        try:
            (seconds,) = [float(value) for value in values]
        except ValueError as error:
            raise InvalidInput(f"fault {words!r}: half-lines S, for S seconds") from error
        self._half_lines_until_s = now_s + seconds
        return True

    def bend(self, sent: bytes, now_s: float) -> bytes:
        """Return what reaches the host of what the device has sent."""
        if self.silent(now_s):
            return b""
        if sent and self.once("garbage"):
            return self._random.randbytes(len(sent)).replace(b"\n", b"\0") + b"\n"
        if now_s < self._half_lines_until_s:
            return bytes(byte for byte in sent if self._random.random() >= _LOST_SHARE)
        return sent

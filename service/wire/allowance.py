"""What somebody may cost: so much a second, and so much at once. Pure; the time is an argument."""

from math import inf


class Allowance:
    """Fills with time up to one second's worth; what is taken may leave a debt that time pays."""

    def __init__(self, per_s: float) -> None:
        self._per_s = per_s
        self._left, self._at_s = per_s, -inf

    def left(self, now_s: float) -> float:
        """Return what may be spent now; below zero after something cost more than there was."""
        if now_s > self._at_s:
            self._left = min(self._per_s, self._left + (now_s - self._at_s) * self._per_s)
            self._at_s = now_s
        return self._left

    def spend(self, amount: float, now_s: float) -> None:
        """Take what something has cost, also when it is more than what is left."""
        self._left = self.left(now_s) - amount

    def take(self, now_s: float) -> bool:
        """Take one if there is one."""
        if self.left(now_s) < 1.0:
            return False
        self.spend(1.0, now_s)
        return True

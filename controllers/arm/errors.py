"""Every exception that pneuarm raises on purpose.

PneuarmError
|-- InvalidInput            an argument of a function: name, value, what is allowed
|-- ConfigurationError      a key of the configuration
|   `-- AlreadyInUse        an arm or a device that another daemon has
|-- HardwareError           a device: connection, answer, diagnosis
|-- LogError                a session log
|-- CalibrationError        a motion, or a log, that does not show what a calibration needs
|-- LearningError           a trajectory, or its trials, from which nothing can be learnt
|   |-- LearningDiverges    trials that become worse
|   `-- TrialLost           one trial that shows nothing; another one may
|-- NotInstalled            a package, or a part of pneuarm, that a command needs
|-- MessageRejected         a message that cannot be read, or that this key does not take
|   `-- TargetRejected      a target that was read, and that the daemon does not take
|-- ModeRefused             a mode change that is not allowed now
|   `-- LeaseRefused        another client holds the arm
|-- MoveTimeout             a target that was taken, and not reached in time
|-- NotConfirmed            a stop whose effect was not seen: cut the air supply
`-- DaemonUnreachable       nobody answers under that address
"""


class PneuarmError(Exception):
    """Root of the tree. The text is one sentence: what, where, what is allowed."""


class InvalidInput(PneuarmError, ValueError):
    """An argument is outside what the function is defined for."""


class ConfigurationError(PneuarmError):
    """A configuration was refused before any device was touched."""


class AlreadyInUse(ConfigurationError):
    """Another daemon has it: process ``process_id``, or None where the kernel does not tell."""

    def __init__(self, text: str, process_id: int | None = None) -> None:
        super().__init__(text)
        self.process_id = process_id


class HardwareError(PneuarmError):
    """A device cannot be reached or answers what its protocol does not allow."""


class LogError(PneuarmError):
    """A session log cannot be read or written."""


class CalibrationError(PneuarmError):
    """What was moved or recorded does not determine the map; the text says what is missing."""


class LearningError(PneuarmError):
    """A trajectory cannot be learnt, or its trials do not show what was to be learnt."""


class LearningDiverges(LearningError):
    """The error grows from trial to trial."""


class TrialLost(LearningError):
    """A trial was not measured as a whole; nothing was learnt from it."""


class NotInstalled(PneuarmError):
    """What a command needs is not installed; the text names what to install."""


class MessageRejected(PneuarmError):
    """A message was refused; nothing changed because of it."""


class TargetRejected(MessageRejected):
    """A target was refused; nothing moved because of it."""


class ModeRefused(PneuarmError):
    """The daemon is in a mode from which the request is not allowed."""


class LeaseRefused(ModeRefused):
    """Another client holds the lease; the text names it."""


class MoveTimeout(PneuarmError):
    """A target was not reached in time; the arm holds when it is no longer refreshed."""


class OutOfReach(PneuarmError):
    """A target that no lengths within the limits reach; the arm is as near to it as it comes.

    ``nearest_m`` (3,) is where the tip is commanded then, in the base frame, and ``limits`` are
    the names of the limits that bind.
    """

    def __init__(self, text: str, nearest_m: tuple[float, ...], limits: tuple[str, ...]) -> None:
        super().__init__(text)
        self.nearest_m, self.limits = nearest_m, limits


class NotConfirmed(PneuarmError):
    """A stop of which nothing showed that it acted; ``why`` is the reason, without the remedy."""

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        """Say what to do, whatever the reason is."""
        return f"NOT CONFIRMED: {self.why}; cut the air supply"


class DaemonUnreachable(PneuarmError):
    """No daemon answered under the address."""

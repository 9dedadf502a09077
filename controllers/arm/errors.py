"""Every exception that pneuarm raises on purpose.

PneuarmError
|-- InvalidInput            an argument of a function: name, value, what is allowed
|-- ConfigurationError      a key of the configuration
|-- HardwareError           a device: connection, answer, diagnosis
|-- LogError                a session log
|-- CalibrationError        a motion, or a log, that does not show what a calibration needs
|-- TargetRejected          a target that the daemon does not take
|-- ModeRefused             a mode change that is not allowed now
|   `-- LeaseRefused        another client holds the arm
`-- DaemonUnreachable       nobody answers under that address
    `-- NotConfirmed        a command was sent and its effect was not seen
"""


class PneuarmError(Exception):
    """Root of the tree. The text is one sentence: what, where, what is allowed."""


class InvalidInput(PneuarmError, ValueError):
    """An argument is outside what the function is defined for."""


class ConfigurationError(PneuarmError):
    """A configuration was refused before any device was touched."""


class HardwareError(PneuarmError):
    """A device cannot be reached or answers what its protocol does not allow."""


class LogError(PneuarmError):
    """A session log cannot be read or written."""


class CalibrationError(PneuarmError):
    """What was moved or recorded does not determine the map; the text says what is missing."""


class TargetRejected(PneuarmError):
    """A target was refused; nothing moved because of it."""


class ModeRefused(PneuarmError):
    """The daemon is in a mode from which the request is not allowed."""


class LeaseRefused(ModeRefused):
    """Another client holds the lease; the text names it."""


class DaemonUnreachable(PneuarmError):
    """No daemon answered under the address."""


class NotConfirmed(DaemonUnreachable):
    """A stop was sent and no state showed that it acted."""

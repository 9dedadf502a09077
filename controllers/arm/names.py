"""What an arm may be called: its name stands in keys of the wire, in files and in addresses."""

import re

from pneuarm.controllers.arm.errors import InvalidInput

#: A small letter, then small letters, digits, `_` and `-`, at most 32 in all.
ARM_NAME = r"^[a-z][a-z0-9_-]{0,31}$"


def check_arm_name(name: str) -> None:
    """Raise InvalidInput for what no arm can be called."""
    if not re.fullmatch(ARM_NAME.strip("^$"), name):
        raise InvalidInput(
            f"arm {name[:64]!r}: a name is a small letter, then small letters, digits, _ and -, at "
            "most 32 in all"
        )

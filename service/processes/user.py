"""Who runs this process."""

import os
import pwd


def user_name() -> str:
    """Return the user's name; the number of one that has none here, as in a container."""
    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return str(os.getuid())

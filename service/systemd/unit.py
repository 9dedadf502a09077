"""`pneuarm systemd`: the unit file of one daemon, with the paths of this installation."""

import argparse
import grp
import os
import re
import sys
from importlib.resources import files
from pathlib import Path

from pneuarm.controllers.arm.errors import ConfigurationError, InvalidInput
from pneuarm.hardware.device import SerialPort
from pneuarm.service.configuration.configuration import Configuration, load
from pneuarm.service.devices import registry as backends
from pneuarm.service.processes.user import user_name

#: What a service has of its own where its unit says PrivateTmp.
_PRIVATE = (Path("/tmp"), Path("/var/tmp"))


def systemd(arguments: argparse.Namespace) -> int:
    """Print the unit file; how to install it, and what is wrong with it, goes to stderr."""
    configuration = load(arguments.config, arguments.arm)
    user = arguments.user or os.environ.get("SUDO_USER") or user_name()
    print(unit_text(configuration, arguments.config, user), end="")
    for path in _passing(configuration, arguments.config):
        print(f"WARNING: {path} is gone when this machine starts anew: move it", file=sys.stderr)
    if sys.stdout is not None and sys.stdout.isatty():
        return 0
    name = f"pneuarm-{configuration.arm.name}.service"
    print(
        f"save it as /etc/systemd/system/{name}, then: sudo systemctl daemon-reload && "
        f"sudo systemctl enable --now {name}",
        file=sys.stderr,
    )
    return 0


def unit_text(configuration: Configuration, path: Path | None, user: str) -> str:
    """Return the unit file for a configuration file, or for its built-in arm."""
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,30}\$?", user):
        raise InvalidInput(f"--user {user[:64]!r}: that is no name of a user")
    what = [str(path.absolute())] if path else ["--arm", configuration.preset]
    command = [sys.executable, "-m", "pneuarm", "run", *what]
    own = [] if _passing(configuration, path) else ["PrivateTmp=yes"]
    if any(not file.is_absolute() for file in _named(configuration)):
        own.append(f"WorkingDirectory={_escaped(str(Path.cwd()))}")
    where = backends.location(configuration)
    if isinstance(where, SerialPort) and where.path:
        own.append(f"DeviceAllow={_escaped(where.path)} rw")
        own.append(f"SupplementaryGroups={_group(where.path)}")
    if configuration.log.directory:
        directory = Path(configuration.log.directory).expanduser().absolute()
        own.append(f"ReadWritePaths={_quoted(f'-{directory}')}")
    template = files("pneuarm.service.systemd").joinpath("pneuarm.service").read_text()
    return template.format(
        arm=configuration.arm.name,
        command=" ".join(_quoted(part).replace("$", "$$") for part in command),
        user=user,
        priority=configuration.control.priority,
        own="".join(f"{line}\n" for line in own),
    )


def _named(configuration: Configuration) -> list[Path]:
    """Files and folders that the configuration names, as the daemon will look for them."""
    texts = (
        configuration.zenoh.config_file,
        configuration.feedback.tip_pose_key_file,
        configuration.log.directory,
    )
    return [Path(text).expanduser() for text in texts if text]


def _passing(configuration: Configuration, path: Path | None) -> list[Path]:
    """What of these lies where a service sees nothing, unless its unit says otherwise."""
    found = [*_named(configuration), Path(sys.executable), *([path] if path else [])]
    return [file for file in found if any(map(file.absolute().is_relative_to, _PRIVATE))]


def _escaped(text: str) -> str:
    """Text as a unit file has it: a percent sign would be a specifier."""
    if any(not character.isprintable() for character in text):
        raise ConfigurationError(f"{text!r} cannot stand in a unit file; choose a plainer path")
    return text.replace("%", "%%")


def _quoted(text: str) -> str:
    """One word of a unit file, in quotation marks where it needs them."""
    escaped = _escaped(text)
    if not any(character in " \t'\"\\;" for character in escaped):
        return escaped
    return '"' + escaped.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _group(device: str) -> str:
    """Group that may open a device file; ``dialout`` where it is not plugged in."""
    try:
        return grp.getgrgid(os.stat(device).st_gid).gr_name
    except (OSError, KeyError):
        return "dialout"

"""`pneuarm run` and `pneuarm config`."""

import argparse

from service.config import load, rerun_url


def run(arguments: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    from service.supervisor import Supervisor

    configuration = load(arguments.config, arguments.arm)
    if arguments.viewer:
        rerun = configuration.rerun.model_copy(update={"open_viewer": True})
        configuration = configuration.model_copy(update={"rerun": rerun})
    return Supervisor(configuration, _say).run()


def _say(line: str) -> None:
    print(line, flush=True)


def config(arguments: argparse.Namespace) -> int:
    """Print the effective configuration, or say that a file is right."""
    configuration = load(arguments.config, arguments.arm)
    if arguments.action == "show":
        print(configuration.to_toml(), end="")
    else:
        sections = len(configuration.arm.sections)
        where = arguments.config or f"preset {configuration.preset}"
        print(
            f"{where}: good; arm {configuration.arm.name}, {3 * sections} chambers, "
            f"{configuration.control.rate_hz:g} Hz, view at {rerun_url(configuration)}"
        )
    return 0

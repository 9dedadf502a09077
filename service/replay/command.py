"""`pneuarm replay` and `pneuarm info`."""

import argparse
import dataclasses
import json
import tomllib
from datetime import UTC, datetime

from pneuarm.controllers.arm.errors import InvalidInput
from pneuarm.logs.reading.reader import LogReader, LogSummary, summarise
from pneuarm.service.configuration.configuration import Configuration, check


def recorded_configuration(reader: LogReader) -> Configuration:
    """Return the configuration with which a log was recorded."""
    return check(tomllib.loads(reader.info.config_toml), str(reader.parts[0]))


def info(arguments: argparse.Namespace) -> int:
    """Say what is in a log."""
    summary = summarise(LogReader(arguments.log))
    if arguments.json:
        print(json.dumps(dataclasses.asdict(summary)))
    else:
        print(_text(summary))
    return 0


def _text(summary: LogSummary) -> str:
    start = datetime.fromtimestamp(summary.start_unix_ns / 1e9, UTC)
    seconds = (summary.end_unix_ns - summary.start_unix_ns) * 1e-9
    state = "closed properly" if summary.finished else "broken off (a crash, or still running)"
    lines = [
        f"log       {summary.path} ({summary.parts} part{'s' * (summary.parts > 1)}, {state})",
        f"arm       {summary.arm}",
        f"start     {start:%Y-%m-%d %H:%M:%S} UTC, {seconds:.1f} s",
        f"size      {summary.size_bytes / 1e6:.1f} MB",
        f"ticks     {summary.ticks}, missing {summary.missing_ticks}",
        "messages  " + ", ".join(f"{key} {n}" for key, n in sorted(summary.messages.items())),
        "versions  " + ", ".join(f"{key} {n}" for key, n in sorted(summary.versions.items())),
    ]
    return "\n".join(lines)


def replay(arguments: argparse.Namespace) -> int:
    """Show a log again, in Rerun or over Zenoh."""
    if not arguments.speed > 0:
        raise InvalidInput(f"--speed {arguments.speed:g}: it must be above 0")
    reader = LogReader(arguments.log)
    if arguments.to == "zenoh":
        from pneuarm.service.replay.to_zenoh import replay_over_zenoh

        return replay_over_zenoh(reader, arguments.speed, arguments.loop, arguments.listen)
    from pneuarm.service.replay.to_rerun import replay_in_rerun

    configuration = recorded_configuration(reader)
    rerun = configuration.rerun.model_copy(update={"port": arguments.port, "bind": "127.0.0.1"})
    return replay_in_rerun(
        reader,
        configuration.model_copy(update={"rerun": rerun}),
        arguments.speed,
        arguments.loop,
    )

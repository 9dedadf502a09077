"""`pneuarm replay` and `pneuarm info`."""

import argparse
import dataclasses
import json
from datetime import UTC, datetime

from pneuarm.controllers.arm.errors import InvalidInput, LogError
from pneuarm.logs.reading.reader import LogReader
from pneuarm.logs.reading.summary import LogSummary, summarise
from pneuarm.service.configuration.configuration import Configuration, recorded

#: Places that are named; there may be thousands.
_DAMAGE_LINES = 20


def recorded_configuration(reader: LogReader) -> Configuration:
    """Return the configuration with which a log was recorded."""
    path = reader.parts[0]
    if not reader.info.config_toml:
        raise LogError(
            f"{path} lacks the configuration with which it was recorded: every copy in it is "
            "damaged; its ticks can be read, and replayed with --to zenoh"
        )
    return recorded(reader.info.config_toml, str(path))


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
    if summary.damage:
        state = "DAMAGED" if summary.finished else "DAMAGED, and broken off"
    lines = [
        f"log       {summary.path} ({summary.parts} part{'s' * (summary.parts > 1)}, {state})",
        f"arm       {summary.arm}",
        f"start     {start:%Y-%m-%d %H:%M:%S} UTC, {seconds:.1f} s",
        f"size      {summary.size_bytes / 1e6:.1f} MB",
        f"ticks     {summary.ticks}, missing {summary.missing_ticks}",
        "messages  " + ", ".join(f"{key} {n}" for key, n in sorted(summary.messages.items())),
        "versions  " + ", ".join(f"{key} {n}" for key, n in sorted(summary.versions.items())),
    ]
    return "\n".join(lines + _missing_lines(summary))


def _missing_lines(summary: LogSummary) -> list[str]:
    """Say what cannot be read: one line a place, and what the file says stood there."""
    lines = []
    if summary.lost:
        lost = ", ".join(f"{key} {n}" for key, n in sorted(summary.lost.items()))
        lines.append(f"lost      {lost}: in the file, and not readable")
    lines += [f"damage    {text}" for text in summary.damage[:_DAMAGE_LINES]]
    if len(summary.damage) > _DAMAGE_LINES:
        lines.append(f"damage    at {len(summary.damage) - _DAMAGE_LINES} more places")
    if summary.cut_bytes:
        lines.append(f"end       {summary.cut_bytes} bytes of an unfinished chunk")
    if summary.damage and not summary.finished:
        lines.append("end       unknown: the file does not say how many ticks came behind the last")
    return lines


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

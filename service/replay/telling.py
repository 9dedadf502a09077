"""What a replay says of the log while it shows it: holes, and what is damaged."""

from pneuarm.logs.reading.reader import LogReader


def say(text: str) -> None:
    """Print one line at once."""
    print(text, flush=True)


def say_damage(reader: LogReader) -> None:
    """Print what of the log could not be shown."""
    for damage in reader.damage:
        if not damage.cut:
            say(f"damaged: {damage}")

"""The smooth reference between targets, and how a stream of them is followed."""

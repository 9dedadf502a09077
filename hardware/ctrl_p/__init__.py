"""The Ctrl-P pressure controller, over USB serial."""

"""The gateway process: what comes in over Zenoh, what goes out, what is refused. No device."""

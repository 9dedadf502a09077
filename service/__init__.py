"""The daemon: configuration, mode machine, loop, gateway, supervisor, client and commands."""

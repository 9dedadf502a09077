"""The daemon and its commands, room by room. Clocks, processes, sockets and Zenoh live here."""

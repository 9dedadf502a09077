"""`pneuarm demo`: the daemon, a client, and the table at the end."""

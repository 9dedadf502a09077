"""The user's own program: the client and its targets. No solver, no Rerun, no MCAP."""

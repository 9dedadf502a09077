"""What a user's program imports: the client and its targets. No solver, no Rerun, no MCAP."""

"""`pneuarm replay` and `pneuarm info`: a recorded session to Rerun, to Zenoh, in figures."""

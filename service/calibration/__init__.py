"""`pneuarm calibrate`: moves the arm, records it, and writes the configuration and its page."""

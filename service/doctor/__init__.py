"""`pneuarm doctor`: is this PC ready, one finding a check, with what to change. Changes nothing."""

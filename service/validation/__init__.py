"""`pneuarm validate table1`: the arm of table 1 identified, computed without and with gravity."""

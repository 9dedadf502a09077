"""What `pneuarm validate table1` computes: the arm of table 1, without and with gravity."""

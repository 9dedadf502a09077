"""What `pneuarm validate table1` computes: the arm of the paper's table 1, without and with gravity."""

"""`pneuarm workspace`: where the tip can be, as figures, files and pictures. No daemon."""

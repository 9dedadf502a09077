"""`pneuarm calibrate`: the motion, the recording, what is written of it."""

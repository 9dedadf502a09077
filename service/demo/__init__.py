"""`pneuarm demo`: daemon and client as processes, and the table of figures at the end."""

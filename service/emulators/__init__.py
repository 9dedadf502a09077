"""`pneuarm emulate`: devices on their real transport, and a camera."""

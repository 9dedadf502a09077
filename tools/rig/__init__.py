"""What tests and tools drive: arms, the loop in simulated time, a real daemon and its wire."""

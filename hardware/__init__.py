"""The arm's air: one interface, one folder a device, and the guard before each of them."""

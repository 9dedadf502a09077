"""What is compared with measurements and with other solvers, not with itself."""

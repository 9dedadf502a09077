"""What counts as a fault, and what follows."""

"""What is wanted, as a vector of parameters, and the weighted rows that it stands for."""

"""The figures of the validation: the paper's table 1, gravity, the models side by side."""

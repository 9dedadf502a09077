"""The tables of a configuration file: every key, its unit and its bounds."""

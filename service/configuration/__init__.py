"""TOML to a checked, frozen configuration: its tables, and the built-in arms. SI from here on."""

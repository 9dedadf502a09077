"""TOML to a checked, frozen configuration, and the built-in arms."""

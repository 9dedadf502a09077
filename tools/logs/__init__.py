"""Random damage to logs of every kind: what a reader still finds, and whether it says the rest."""

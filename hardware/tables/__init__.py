"""What the tables of a configuration file are made of, and the tables that devices need."""

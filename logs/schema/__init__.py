"""Protobuf definitions and the Python generated from them (`make proto`)."""

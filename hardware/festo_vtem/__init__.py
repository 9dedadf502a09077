"""Festo VTEM motion terminals, over Modbus TCP."""

"""Festo CPX terminals with VPPM proportional pressure valves, over Modbus TCP."""

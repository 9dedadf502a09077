"""Modbus TCP and serial lines; their servers for emulated devices, and how they break."""

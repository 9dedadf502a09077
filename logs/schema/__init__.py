"""Messages and keys: the .proto, the Python made of it (`make proto`), and the codec."""

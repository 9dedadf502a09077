"""The ESP32 controller of three chambers, over USB serial."""

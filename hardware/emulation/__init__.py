"""The arm behind an emulated device, with broken valves and sensors on demand."""

"""The control process: the tick, its deadlines, its steering. Waits for nobody, loads no Zenoh."""

"""Chamber pressure to chamber length and back; hysteresis, valve lag and stiction inverted."""

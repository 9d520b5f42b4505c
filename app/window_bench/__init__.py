"""How quickly the window answers: drives the real one and prints medians, the time that pictures take told apart."""

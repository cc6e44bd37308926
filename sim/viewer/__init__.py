"""Episodes in 3-D in a browser: live while they are simulated, or played from a trace by one HTML file."""

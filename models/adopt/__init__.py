"""Makes a robot that keeps our conventions out of any biped's MJCF, and says what was found, chosen and assumed."""

"""What a robot perceives of itself: encoders, IMU and soles with their errors, all of it late, and what a drive makes
of a reference."""

"""From late and noisy readings to an observation: an invariant Kalman filter, a push observer and a look ahead."""

"""The simulated vessel, its sensors, its actuator board, its radio and its water, in lock-step with the real app."""

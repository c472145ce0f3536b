"""The actuator board in simulation: its Python twin, and the real firmware on a simulated chip."""

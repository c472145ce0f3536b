"""What may stop the boat, and shares nothing with what steers it: failsafe, fence, monitors, and the gate before the actuators."""

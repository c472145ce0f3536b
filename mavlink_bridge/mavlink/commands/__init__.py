"""The command protocol: what each MAV_CMD means for a boat, and how it is answered."""

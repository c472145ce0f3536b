"""Reports: one self-contained HTML file about a run directory or any telemetry log. Loads matplotlib only when drawing."""

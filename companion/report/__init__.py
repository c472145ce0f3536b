"""Reports: one self-contained HTML file about a run directory or any telemetry log, drawn by the browser that opens it."""

"""Parameters, MAVLink FTP, component metadata and log download: what a station reads of the vessel."""

"""The vessel's own words, known to every room and knowing none: messages, manoeuvres, requests, the snapshot, units, one WGS-84."""

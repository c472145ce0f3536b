"""The only I/O of the vessel: clocks, links, recorder, store and the loop."""

"""Measuring cells of the benches: a hull, its guidance and control, and nothing else."""

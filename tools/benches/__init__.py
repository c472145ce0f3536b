"""The benchmarks: each module has ``run()``, which gives rows of {name, value, unit, bar, holds}; ``tools.bench`` runs them."""

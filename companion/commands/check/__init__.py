"""``companion check`` and ``companion explain``: a configuration told in words, before it reaches the water."""

"""The vessel: decisions in ``core``, devices in ``io``, one composition root in ``app``."""

"""What the vessel says by itself: streams, texts, and the queues in which they wait for the link."""

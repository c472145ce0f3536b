"""The mission protocol: missions, fences and rally points up and down, and plan items to manoeuvres and back."""

"""The radio's bits: frames, plans, states, commands and requests as few bytes as they need."""

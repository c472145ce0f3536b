"""Records of other hands before a fit believes them: tables as text, copies, places and helms that cannot be."""

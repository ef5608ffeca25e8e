"""Contact planners (P2): contact states along a guide."""

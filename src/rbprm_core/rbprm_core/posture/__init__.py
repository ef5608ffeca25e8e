"""Posture generators: a whole-body configuration that satisfies contacts, statics and limits."""

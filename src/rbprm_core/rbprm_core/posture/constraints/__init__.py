"""Constraints of posture problems; each file one."""

"""Reachability-based acyclic multi-contact planning for legged robots.

Data flows one way: a robot and a scene, a request, the guide path of the root (P1), the sequence
of contact states along it (P2), the contact plan, its independent check.
"""

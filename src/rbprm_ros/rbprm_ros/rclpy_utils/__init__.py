"""Helpers around rclpy: awaiting, spinning, signals, subscriptions, quality of service."""

"""The planner's environment: surfaces and obstacles, and their updates."""

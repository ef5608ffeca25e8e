"""Motion planners: the motion that executes a contact sequence."""

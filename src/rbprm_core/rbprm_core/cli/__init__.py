"""The command line `rbprm`: one module for each command."""

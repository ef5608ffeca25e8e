"""The version of rbprm, in the one place where it is written by hand.

`package.xml` and `pyproject.toml` of the ROS packages, CITATION.cff and the change log repeat it;
a test compares them.
"""

__version__ = "0.2.0"

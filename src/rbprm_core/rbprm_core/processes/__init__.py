"""Child processes that plan: started by `subprocess`, reached over a socket pair."""

from rbprm_core.processes.channel import Channel, ChannelClosed, PeerHung, readable
from rbprm_core.processes.child import ChildProcess, exit_text, module_command
from rbprm_core.processes.serving import ReportThrottle, serve_parent

__all__ = [
    "Channel",
    "ChannelClosed",
    "ChildProcess",
    "PeerHung",
    "ReportThrottle",
    "exit_text",
    "module_command",
    "readable",
    "serve_parent",
]

"""What an episode leaves: the trace of every control tick, the verdict that is judged from it, motors, versions."""

from sim.record.outcome import Outcome, Reason, Result, judge
from sim.record.trace import Trace, load_trace

__all__ = ["Outcome", "Reason", "Result", "Trace", "judge", "load_trace"]

"""What happens: scenario and suite files, their fields and defaults, and the one line that refuses a bad one."""

from scenarios.catalogue import load
from scenarios.push import Push
from scenarios.schema import Scenario
from scenarios.suite_catalogue import load_suite

__all__ = ["Push", "Scenario", "load", "load_suite"]

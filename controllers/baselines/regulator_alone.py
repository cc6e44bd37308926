"""The null controller `regulator`: the supervisor's law, limited to the support polygon, without steps."""

from __future__ import annotations

from controllers.supervisor.supervisor import Supervisor


class RegulatorAlone(Supervisor):
    """Stays where it stands, by the regulator's gain alone."""

    label, colour, marker = "regulator", "#1f5fd6", "s"

    def _learn_to_step(self, *, on_body: bool) -> None:
        """It never steps, and has no softer gain to fall back on."""

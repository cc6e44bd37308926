"""The controller: pendulum, maximal output admissible sets, regulator, tracker, supervisor, whole-body layer."""

"""A whole-body layer that keeps what it was given in an episode, and what it answered."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from controllers.interface import BalanceCommand, JointTargets, Observation, WholeBodyLayer
from models.arena import SIDES
from models.robot import load_robot
from scenarios.catalogue import load
from sim.episode.build import make_layer
from sim.episode.episode import EpisodeResult, run_episode


@dataclass(frozen=True)
class Tick:
    seen: Observation
    command: BalanceCommand
    targets: JointTargets

    @property
    def stands(self) -> bool:
        return all(self.command.feet[side].stance for side in SIDES)


class RecordedLayer:
    """Hands everything on to a layer, and keeps it."""

    def __init__(self, layer: WholeBodyLayer) -> None:
        self._layer = layer
        self.follows_acceleration = layer.follows_acceleration
        self.ticks: list[Tick] = []

    def reset(self) -> None:
        self._layer.reset()
        self.ticks.clear()

    def targets(self, observation: Observation, command: BalanceCommand) -> JointTargets:
        targets = self._layer.targets(observation, command)
        self.ticks.append(Tick(observation, command, targets))
        return targets


def recorded(changes: dict[str, Any]) -> tuple[EpisodeResult, list[Tick]]:
    """The scenario `quiet` with changes to it: what came of it, and each tick of its layer."""
    scenario = load("quiet", changes)
    layer = RecordedLayer(make_layer(scenario, load_robot(scenario.robot)))
    return run_episode(scenario, layer=layer, polygons=False), layer.ticks

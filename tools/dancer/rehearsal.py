"""Rehearsals: thousands of robots, each on its way through one of the dancer's motions.

Half of the episodes begin anywhere, half shortly before a step where robots are often lost.
Metres, radians, seconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from tools.dancer.device_graph import recorded
from tools.dancer.expert_advice import Experts
from tools.dancer.mujoco_robots import Robots
from tools.dancer.rehearsal_reward import Scoring
from tools.dancer.repertoire import Motions, Steps, heading
from tools.dancer.sight import Sight

EPISODE_S, BIN_S, BEFORE_S = 8.0, 0.5, 1.5
"""Longest episode; length of the bins whose losses are counted; longest time before such a bin
from which a robot begins again."""
STAND_SHARE, WEAK_SHARE, FORGET, FIRST_RATE = 0.03, 0.35, 0.002, 0.02
MOST_RATE = 0.03
"""Loss rate of a bin at most in the draw: a place that no robot passes takes no more starts."""
PUSH_EVERY_S, PUSHES = (1.0, 4.0), 0.25
"""Time between pushes; their size, multiples of the pack's."""
FRICTION, STRENGTH = (0.6, 1.3), (0.9, 1.1)
"""Factors on friction and on the gains, uniform."""


@dataclass(frozen=True)
class Outcome:
    """What a control step brought, (N,) each.

    Attributes:
        reward: Reward.
        lost: Whether the robot was lost.
        over: Whether the episode ended without that: time or motion are over.
    """

    reward: torch.Tensor
    lost: torch.Tensor
    over: torch.Tensor


class Rehearsal:
    """N robots that begin new episodes as soon as theirs end.

    Attributes:
        seen: Present observations, (N, D).
        action: Last actions, (N, nu).
        loss_rate: Moving average of the share of robots lost in a step, of every bin.
    """

    def __init__(
        self,
        pack: Mapping[str, np.ndarray],
        robots: Robots,
        device: str,
        seed: int,
        everything: bool = False,
    ) -> None:
        self._random = torch.Generator(device).manual_seed(seed)
        self.robots, self.motions = robots, Motions(pack, device)
        self.sight = Sight(pack, self.motions.preview.shape[1], self._random, everything)
        self._scoring, self._device, self.n = Scoring(pack, device), device, robots.n
        self._standing, self._scale, self._hinge = (
            torch.as_tensor(pack[name], device=device) for name in ("standing", "scale", "hinge")
        )
        self._noise = [float(x) for x in pack["reset"]]
        self._limit = round(EPISODE_S / self.motions.dt)
        self._push = PUSHES * torch.as_tensor(pack["push"], device=device)
        self._motion, self._step, self._age, self._push_at = torch.zeros(
            (4, self.n), dtype=torch.long, device=device
        )
        self.action, self._next = torch.zeros_like(robots.targets), torch.zeros_like(robots.targets)
        self._before = torch.zeros_like(robots.points)
        rows = torch.arange(len(self.motions.qpos), device=device)
        self._bin = rows // round(BIN_S / self.motions.dt)
        self.loss_rate = torch.full((int(self._bin[-1]) + 1,), FIRST_RATE, device=device)
        heavy = torch.as_tensor(pack["weight"], device=device).repeat_interleave(2)
        self._weight = heavy * self.motions.length.float()
        robots.strength.copy_(self._uniform(*STRENGTH, (self.n,)))
        robots.friction.mul_(self._uniform(*FRICTION, (self.n, 1, 1)))
        self._begin(torch.ones(self.n, dtype=torch.bool, device=device))
        self._age.copy_(self._whole(self._limit))
        self.seen = self._observe()
        none = torch.zeros(self.n, dtype=torch.bool, device=device)
        self._outcome = Outcome(torch.zeros(self.n, device=device), none, none.clone())
        self._aim = recorded(self._set_targets, self.seen.device, self._random)
        self._conclude = recorded(self._take_stock, self.seen.device, self._random)

    def step(self, action: torch.Tensor) -> Outcome:
        """Act for one control step, -1..1; robots whose episodes end begin new ones.

        The next step writes over the tensors of the outcome.
        """
        self._next.copy_(action)
        self._aim()
        self.robots.step()
        self._conclude()
        return self._outcome

    def advice(self, experts: Experts) -> tuple[torch.Tensor, torch.Tensor]:
        """Return what experts advise now, (N, nu), and which robots have an expert, (N,)."""
        return experts.advise(self.robots, self._motion, self._step)

    def calm(self, rows: torch.Tensor) -> None:
        """Begin all episodes again at rows of the motions (N,), without pushes and noise of the
        sensors from now on."""
        self.sight.noise.zero_()
        self._begin(torch.ones(self.n, dtype=torch.bool, device=self._device), rows)
        self.seen.copy_(self._observe())

    def anywhere(self) -> torch.Tensor:
        """Return rows of the motions, (N,), captured ones more often."""
        chosen = self._chosen(self._weight)
        length = self.motions.length[chosen]
        part = (self._uniform(0.0, 1.0, (self.n,)) * length).long()
        return self.motions.first[chosen] + torch.minimum(part, length - 1)

    def _set_targets(self) -> None:
        """Move the targets of the motors by the next actions."""
        at = self._following()
        self._next.clamp_(-1, 1)
        self._before.copy_(self.robots.points)
        moved = self._scale * self._next
        self.robots.targets.copy_(at.qpos[:, 7:][:, self._hinge] + at.lead + moved)

    def _take_stock(self) -> None:
        """Write the outcome of a control step, begin new episodes and observe."""
        at, robots = self._following(), self.robots
        change = (self._next - self.action).square().mean(1)
        self.action.copy_(self._next)
        self._step += 1
        self._age += 1
        moved = (robots.points - self._before) / self.motions.dt
        reward, lost = self._scoring.judge(robots, at, moved, change)
        ended = self.motions.ended(self._motion, self._step) | (self._age >= self._limit)
        self._count(lost)
        self._push_some()
        self._begin(lost | ended)
        self.seen.copy_(self._observe())
        results = (reward, lost, ended & ~lost)
        written = (self._outcome.reward, self._outcome.lost, self._outcome.over)
        for held, result in zip(written, results, strict=True):
            held.copy_(result)

    def _following(self) -> Steps:
        return self.motions.at(self._motion, self._step + 1)

    def _observe(self) -> torch.Tensor:
        return self.sight.observe(self.robots, self._following(), self.action)

    def _begin(self, those: torch.Tensor, rows: torch.Tensor | None = None) -> None:
        """Begin new episodes of the robots of a mask."""
        row = self._drawn() if rows is None else rows
        motion = self.motions.motion[row]
        step = row - self.motions.first[motion]
        at = self.motions.at(motion, step)
        hinges, speeds, root = self._noise
        qpos, qvel = at.qpos.clone(), at.qvel.clone()
        qpos[:, 7:] += hinges * self._normal(qpos[:, 7:].shape)
        qvel[:, 6:] += speeds * self._normal(qvel[:, 6:].shape)
        qvel[:, :6] += root * self._normal(qvel[:, :6].shape)
        stands = self._uniform(0.0, 1.0, (self.n, 1)) < STAND_SHARE
        yaw = heading(at.qpos[:, 3:7]) / 2
        stand = self._standing.repeat(self.n, 1)
        stand[:, :2] = at.qpos[:, :2]
        stand[:, 3:7] = torch.stack([torch.cos(yaw), 0 * yaw, 0 * yaw, torch.sin(yaw)], 1)
        qpos, qvel = torch.where(stands, stand, qpos), torch.where(stands, 0.0, qvel)
        self.robots.place(those, qpos, qvel, at.points)
        self._motion.copy_(torch.where(those, motion, self._motion))
        self._step.copy_(torch.where(those, step, self._step))
        self._age.masked_fill_(those, 0)
        self._push_at.copy_(torch.where(those, self._waits(), self._push_at))
        self.action.masked_fill_(those[:, None], 0.0)

    def _drawn(self) -> torch.Tensor:
        """Return rows of the motions to begin at, never the end of one that ends."""
        bins = self._chosen(self.loss_rate.clamp(max=MOST_RATE))
        size = round(BIN_S / self.motions.dt)
        weak = (bins * size + self._whole(size)).clamp(max=len(self._bin) - 1)
        back = self._uniform(0.0, BEFORE_S / self.motions.dt, (self.n,)).long()
        weak = torch.maximum(weak - back, self.motions.first[self.motions.motion[weak]])
        rows = torch.where(self._uniform(0.0, 1.0, (self.n,)) < WEAK_SHARE, weak, self.anywhere())
        motion = self.motions.motion[rows]
        last = self.motions.first[motion] + self.motions.length[motion] - 1
        return torch.where(self.motions.cyclic[motion], rows, torch.minimum(rows, last - 1))

    def _count(self, lost: torch.Tensor) -> None:
        """Record in which bins robots were, and how many were lost there."""
        bins = self._bin[self.motions.row(self._motion, self._step)]
        none = torch.zeros_like(self.loss_rate)
        visits = none.index_add(0, bins, torch.ones(self.n, device=self._device))
        losses = none.index_add(0, bins, lost.float())
        share = 1 - (1 - FORGET) ** visits
        self.loss_rate += share * (losses / visits.clamp(min=1) - self.loss_rate)
        self.loss_rate.clamp_(min=1e-4)

    def _push_some(self) -> None:
        due = self._age >= self._push_at
        kick = self.sight.noise * self._push * self._uniform(-1.0, 1.0, (self.n, 6))
        self.robots.qvel[:, :6] += torch.where(due[:, None], kick, 0.0)
        self._push_at.copy_(torch.where(due, self._age + self._waits(), self._push_at))

    def _waits(self) -> torch.Tensor:
        return (self._uniform(*PUSH_EVERY_S, (self.n,)) / self.motions.dt).long()

    def _chosen(self, weight: torch.Tensor) -> torch.Tensor:
        """Draw numbers of a weight each, (N,); `torch.multinomial` cannot be recorded."""
        edges = weight.double().cumsum(0)
        drawn = self._uniform(0.0, 1.0, (self.n,)).double() * edges[-1]
        return torch.searchsorted(edges, drawn, right=True).clamp(max=len(weight) - 1)

    def _whole(self, below: int) -> torch.Tensor:
        return torch.randint(below, (self.n,), generator=self._random, device=self._device)

    def _uniform(self, low: float, high: float, shape: tuple[int, ...]) -> torch.Tensor:
        drawn = torch.rand(shape, generator=self._random, device=self._device)
        return low + (high - low) * drawn

    def _normal(self, shape: torch.Size) -> torch.Tensor:
        return torch.randn(shape, generator=self._random, device=self._device)

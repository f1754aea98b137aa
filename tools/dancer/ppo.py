"""Proximal policy optimisation (Schulman et al., 2017) of the dancer, on one device.

Generalised advantages (Schulman et al., 2016); the step of Adam follows the divergence of the
policy, as in rsl_rl.
"""

from dataclasses import dataclass

import torch
from torch import nn

from tools.dancer.device_graph import recorded
from tools.dancer.expert_advice import Experts
from tools.dancer.network import Dancer
from tools.dancer.rehearsal import Rehearsal

GAMMA, LAMBDA, CLIP = 0.99, 0.95, 0.2
EPOCHS, PARTS = 5, 4
ENTROPY, VALUE, MOST_GRADIENT = 0.0005, 1.0, 1.0
DIVERGENCE, LEAST_RATE, MOST_RATE = 0.02, 2e-5, 2e-3


@dataclass
class Round:
    """What the robots did for T steps, (T, N, ...) each; `seen` is scaled."""

    seen: torch.Tensor
    action: torch.Tensor
    reward: torch.Tensor
    done: torch.Tensor
    value: torch.Tensor
    log_likelihood: torch.Tensor
    mean: torch.Tensor
    advice: torch.Tensor
    advised: torch.Tensor
    last_value: torch.Tensor
    lost: float
    over: float


class Trainer:
    """Dancer and robots, round by round.

    Args:
        horizon: Control steps of a round.
        rate: First step of Adam; a trained dancer needs a small one, because Adam's first steps
            are as long as its later ones.
        experts: What is advised where; none advises without them.

    Attributes:
        imitation: Weight of the squared distance from the experts' advice in the loss.
        learning: Whether the policy learns from rewards; the critic always does.
    """

    def __init__(
        self, dancer: Dancer, rehearsal: Rehearsal, horizon: int, rate: float,
        experts: Experts | None = None,
    ) -> None:  # fmt: skip
        self._experts, self.imitation, self.learning = experts, 0.0, True
        self.dancer, self._rehearsal, self._horizon = dancer, rehearsal, horizon
        self._rate, on_gpu = rate, rehearsal.seen.is_cuda
        self._optimiser = torch.optim.Adam(dancer.parameters(), lr=rate, fused=on_gpu)
        n, motors = rehearsal.n, len(dancer.log_deviation)
        shapes = {"seen": rehearsal.seen.shape, "action": (n, motors), "mean": (n, motors),
                  "value": (n,), "log_likelihood": (n,), "advice": (n, motors),
                  "advised": (n,)}  # fmt: skip
        device = rehearsal.seen.device
        self._led = torch.zeros(n, 1, dtype=torch.bool, device=device)
        self._chosen = {name: torch.zeros(shape, device=device) for name, shape in shapes.items()}
        self._choose = recorded(self._write_choice, device)

    @property
    def round_steps(self) -> int:
        """Control steps of a round, of all robots together."""
        return self._horizon * self._rehearsal.n

    def round(self) -> dict[str, float]:
        """Rehearse and learn; return figures."""
        done = self._rehearse()
        advantage = advantages(done)
        losses = self._learn(done, advantage)
        steps = done.reward.numel()
        ends = max(1.0, done.lost + done.over)
        deviation = float(self.dancer.log_deviation.detach().exp().mean())
        return {"reward": float(done.reward.mean()), "lost": done.lost / steps,
                "episode_steps": steps / ends, "deviation": deviation, "rate": self._rate,
                **losses}  # fmt: skip

    @torch.no_grad()
    def _rehearse(self) -> Round:
        dancer, rehearsal = self.dancer, self._rehearsal
        rows: dict[str, list[torch.Tensor]] = {
            name: [] for name in (*self._chosen, "reward", "lost", "over")
        }
        dancer.scale.learn(rehearsal.seen)
        for _ in range(self._horizon):
            self._choose()
            outcome = rehearsal.step(self._chosen["action"])
            now = (*self._chosen.values(), outcome.reward, outcome.lost, outcome.over)
            for name, one in zip(rows, now, strict=True):
                rows[name].append(one.clone())
        last = dancer.value(dancer.scale(rehearsal.seen))
        every = {name: torch.stack(many) for name, many in rows.items()}
        lost, over = every.pop("lost"), every.pop("over")
        every["reward"] += GAMMA * every["value"] * over  # as if it went on
        ended = {"done": lost | over, "last_value": last}
        return Round(**every, **ended, lost=float(lost.sum()), over=float(over.sum()))

    def _write_choice(self) -> None:
        """Draw the actions of all robots."""
        dancer = self.dancer
        seen = dancer.scale(self._rehearsal.seen)
        mean = dancer.act(seen)
        action = mean + dancer.log_deviation.exp() * torch.randn_like(mean)
        log = _log_likelihood(action, mean, dancer.log_deviation)
        advice, advised = torch.zeros_like(mean), torch.zeros(len(mean), device=mean.device)
        if self._experts is not None:
            advice, knows = self._rehearsal.advice(self._experts)
            advised = knows.float()
            action = torch.where(self._led & knows[:, None], action - mean + advice, action)
        choice = (seen, action, mean, dancer.value(seen), log, advice, advised)
        for held, one in zip(self._chosen.values(), choice, strict=True):
            held.copy_(one)

    def _learn(self, done: Round, advantage: torch.Tensor) -> dict[str, float]:
        goal = (advantage + done.value).flatten()
        scaled = ((advantage - advantage.mean()) / (advantage.std() + 1e-8)).flatten()
        seen, action, mean = (x.flatten(0, 1) for x in (done.seen, done.action, done.mean))
        before, log_deviation = (
            done.log_likelihood.flatten(),
            self.dancer.log_deviation.detach().clone(),
        )
        advice, advised = done.advice.flatten(0, 1), done.advised.flatten()
        count = len(goal)
        figures = torch.zeros(4, device=goal.device)
        for _ in range(EPOCHS):
            order = torch.randperm(count, device=goal.device)
            for rows in order.chunk(PARTS):
                now = self.dancer.act(seen[rows])
                log = _log_likelihood(action[rows], now, self.dancer.log_deviation)
                ratio = torch.exp(log - before[rows])
                gain = scaled[rows]
                clipped = ratio.clamp(1 - CLIP, 1 + CLIP)
                policy = -torch.minimum(ratio * gain, clipped * gain).mean()
                value = (self.dancer.value(seen[rows]) - goal[rows]).square().mean()
                loss = VALUE * value
                off = ((now - advice[rows]).square().sum(1) * advised[rows]).mean()
                if self.learning:
                    loss = loss + policy - ENTROPY * self.dancer.log_deviation.sum()
                if self.imitation:
                    loss = loss + self.imitation * off
                self._optimiser.zero_grad(set_to_none=True)
                loss.backward()
                nn.utils.clip_grad_norm_(self.dancer.parameters(), MOST_GRADIENT)
                self._optimiser.step()
                apart = _divergence(
                    mean[rows], log_deviation, now.detach(), self.dancer.log_deviation.detach()
                )
                figures += torch.stack([policy.detach(), value.detach(), apart, off.detach()])
            if self.learning:
                self._adapt(float(apart))
        policy, value, apart, off = (figures / (EPOCHS * PARTS)).tolist()
        return {"policy_loss": policy, "value_loss": value, "divergence": apart, "off": off}

    def lead(self, share: float) -> None:
        """Let experts choose the actions of a share of the robots."""
        self._led.fill_(False)
        self._led[: round(share * len(self._led))] = True

    def set_rate(self, rate: float) -> None:
        """Set the step of Adam."""
        self._rate = rate
        for group in self._optimiser.param_groups:
            group["lr"] = rate

    def _adapt(self, divergence: float) -> None:
        if divergence > 2 * DIVERGENCE:
            self._rate = max(LEAST_RATE, self._rate / 1.5)
        elif divergence < DIVERGENCE / 2:
            self._rate = min(MOST_RATE, self._rate * 1.5)
        for group in self._optimiser.param_groups:
            group["lr"] = self._rate


def advantages(done: Round) -> torch.Tensor:
    """Return the generalised advantages of a round, (T, N); none crosses an episode's end."""
    advantage = torch.zeros_like(done.reward)
    coming, next_value = torch.zeros_like(done.last_value), done.last_value
    for k in range(len(done.reward) - 1, -1, -1):
        going = 1.0 - done.done[k].float()
        error = done.reward[k] + GAMMA * next_value * going - done.value[k]
        coming = error + GAMMA * LAMBDA * going * coming
        advantage[k], next_value = coming, done.value[k]
    return advantage


def _log_likelihood(
    action: torch.Tensor, mean: torch.Tensor, log_deviation: torch.Tensor
) -> torch.Tensor:
    apart = (action - mean) / log_deviation.exp()
    return -(0.5 * apart.square() + log_deviation).sum(-1)


def _divergence(
    mean: torch.Tensor, log: torch.Tensor, new: torch.Tensor, new_log: torch.Tensor
) -> torch.Tensor:
    ratio = (2 * (log - new_log)).exp() + ((mean - new) / new_log.exp()).square()
    return (new_log - log + 0.5 * ratio - 0.5).sum(-1).mean()

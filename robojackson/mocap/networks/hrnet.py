"""HRNet-W48 (Sun et al., CVPR 2019) with its classification head, as HybrIK uses it.

Four branches of 48, 96, 192 and 384 channels at 1/4 to 1/32 of the image, mixed after every module.
From a 256 x 256 crop: 29 heatmaps of 64 x 64 x 64, and one feature vector of 2048.
"""

from collections.abc import Sequence
from functools import reduce
from itertools import pairwise

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from robojackson.mocap.networks.residual_blocks import BasicBlock, Bottleneck, convolution, normed

WIDTHS = (48, 96, 192, 384)
BLOCKS = 4
MODULES = {2: 1, 3: 4, 4: 3}
"""Stage (equal to its number of branches) -> modules."""
HEAD_WIDTHS = (32, 64, 128, 256)
FEATURES = 2048
HEATMAP_CHANNELS = 29 * 64


class Mixing(nn.Module):
    """One module: blocks on every branch, then every branch summed into every other."""

    def __init__(self, widths: Sequence[int]) -> None:
        super().__init__()
        self.branches = nn.ModuleList(
            nn.Sequential(*[BasicBlock(width, width) for _ in range(BLOCKS)]) for width in widths
        )
        count = range(len(widths))
        self.fuse_layers = nn.ModuleList(
            nn.ModuleList(_path(widths, source, target) for source in count) for target in count
        )

    def forward(self, images: list[Tensor]) -> list[Tensor]:
        """Return the branches after one module, same shapes."""
        images = [branch(image) for branch, image in zip(self.branches, images, strict=True)]
        mixed = []
        for paths in self.fuse_layers:
            assert isinstance(paths, nn.ModuleList)
            terms = [path(image) for path, image in zip(paths, images, strict=True)]
            mixed.append(functional.relu(reduce(torch.add, terms)))
        return mixed


class HRNet(nn.Module):
    """The trunk; `forward` returns the heatmaps' channels and the feature vector."""

    def __init__(self) -> None:
        super().__init__()
        self.conv1, self.bn1 = convolution(3, 3, 64, 2), nn.BatchNorm2d(64)
        self.conv2, self.bn2 = convolution(3, 64, 64, 2), nn.BatchNorm2d(64)
        first = [Bottleneck(64, 64), *(Bottleneck(256, 64) for _ in range(3))]
        self.layer1 = nn.Sequential(*first)
        self.transition1 = nn.ModuleList(
            [normed(3, 256, WIDTHS[0]), nn.Sequential(normed(3, 256, WIDTHS[1], 2))]
        )
        self.transition2, self.transition3 = _opening(2), _opening(3)
        self.stage2, self.stage3, self.stage4 = (_stage(number) for number in (2, 3, 4))
        self.incre_modules = nn.ModuleList(
            nn.Sequential(Bottleneck(width, head))
            for width, head in zip(WIDTHS, HEAD_WIDTHS, strict=True)
        )
        wide = [width * Bottleneck.expansion for width in HEAD_WIDTHS]
        self.downsamp_modules = nn.ModuleList(
            _biased(3, low, high, 2) for low, high in pairwise(wide)
        )
        self.final_feat_layer = _biased(1, wide[-1], FEATURES, 1)
        self.final_layer = nn.Conv2d(WIDTHS[0], HEATMAP_CHANNELS, 1)

    def forward(
        self, image: Float[Tensor, "B 3 256 256"]
    ) -> tuple[Float[Tensor, "B 1856 64 64"], Float[Tensor, "B 2048"]]:
        """Return heatmaps, depth within channels, and features."""
        image = functional.relu(self.bn1(self.conv1(image)))
        image = self.layer1(functional.relu(self.bn2(self.conv2(image))))
        branches = self.stage2([change(image) for change in self.transition1])
        for opening, stage in ((self.transition2, self.stage3), (self.transition3, self.stage4)):
            kept = [change(branch) for change, branch in zip(opening, branches, strict=False)]
            branches = stage([*kept, opening[-1](branches[-1])])
        return self.final_layer(branches[0]), self._features(branches)

    def _features(self, branches: list[Tensor]) -> Float[Tensor, "B 2048"]:
        total = self.incre_modules[0](branches[0])
        for grow, shrink, branch in zip(
            self.incre_modules[1:], self.downsamp_modules, branches[1:], strict=True
        ):
            total = grow(branch) + shrink(total)
        result: Float[Tensor, "B 2048"] = self.final_feat_layer(total).mean((2, 3))
        return result


def _stage(number: int) -> nn.Sequential:
    return nn.Sequential(*[Mixing(WIDTHS[:number]) for _ in range(MODULES[number])])


def _opening(branches: int) -> nn.ModuleList:
    """Return layers that keep the branches and add one from the smallest."""
    new = nn.Sequential(normed(3, WIDTHS[branches - 1], WIDTHS[branches], 2))
    return nn.ModuleList([*(nn.Identity() for _ in range(branches)), new])


def _path(widths: Sequence[int], source: int, target: int) -> nn.Module:
    """Return layers from one branch's size and width to another's."""
    if source == target:
        return nn.Identity()
    if source > target:
        grow = nn.Upsample(scale_factor=2 ** (source - target), mode="nearest")
        narrow = normed(1, widths[source], widths[target], relu=False)
        assert isinstance(narrow, nn.Sequential)
        return nn.Sequential(*narrow, grow)
    steps = [normed(3, widths[source], widths[source], 2) for _ in range(target - source - 1)]
    return nn.Sequential(*steps, normed(3, widths[source], widths[target], 2, relu=False))


def _biased(size: int, inputs: int, outputs: int, stride: int) -> nn.Sequential:
    """Return layers as `normed`, with a bias that has no effect before the batch norm; the weights
    have it."""
    layer = nn.Conv2d(inputs, outputs, size, stride, size // 2)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU())

"""ResNet-34 (He et al. 2016) without its classifier: a 256 x 256 crop to 512 maps of 8 x 8."""

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from robojackson.mocap.networks.residual_blocks import BasicBlock

LAYERS = ((64, 3), (128, 4), (256, 6), (512, 3))
"""Width and number of blocks; every layer but the first halves the image."""


class ResNet34(nn.Module):
    """The trunk of ResNet-34."""

    def __init__(self) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(3, 64, 7, 2, 3, bias=False)
        self.bn1 = nn.BatchNorm2d(64)
        inputs = 64
        for number, (width, blocks) in enumerate(LAYERS, 1):
            first = BasicBlock(inputs, width, 1 if number == 1 else 2)
            rest = [BasicBlock(width, width) for _ in range(blocks - 1)]
            self.add_module(f"layer{number}", nn.Sequential(first, *rest))
            inputs = width

    def forward(self, image: Float[Tensor, "B 3 256 256"]) -> Float[Tensor, "B 512 8 8"]:
        """Return the feature maps."""
        image = functional.relu(self.bn1(self.conv1(image)))
        image = functional.max_pool2d(image, 3, 2, 1)
        for number in range(1, len(LAYERS) + 1):
            image = self.get_submodule(f"layer{number}")(image)
        return image

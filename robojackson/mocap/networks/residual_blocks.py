"""The residual blocks of the two trunks; names of the parts are those of the published weights."""

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional


def convolution(size: int, inputs: int, outputs: int, stride: int = 1) -> nn.Conv2d:
    """Return a convolution without bias that keeps the image's size at stride one."""
    return nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False)


def normed(size: int, inputs: int, outputs: int, stride: int = 1, relu: bool = True) -> nn.Module:
    """Return convolution, batch norm and optionally ReLU."""
    parts: list[nn.Module] = [
        convolution(size, inputs, outputs, stride),
        nn.BatchNorm2d(outputs),
    ]
    return nn.Sequential(*parts, *([nn.ReLU()] if relu else []))


class BasicBlock(nn.Module):
    """Two 3x3 convolutions beside a shortcut (He et al. 2016)."""

    expansion = 1

    def __init__(self, inputs: int, width: int, stride: int = 1) -> None:
        super().__init__()
        self.conv1, self.bn1 = convolution(3, inputs, width, stride), nn.BatchNorm2d(width)
        self.conv2, self.bn2 = convolution(3, width, width), nn.BatchNorm2d(width)
        self.downsample = _shortcut(inputs, width, stride)

    def forward(self, image: Float[Tensor, "B C H W"]) -> Float[Tensor, "B D h w"]:
        """Return the block's output, stride pixels apart."""
        inner = functional.relu(self.bn1(self.conv1(image)))
        return functional.relu(self.bn2(self.conv2(inner)) + _short(self.downsample, image))


class Bottleneck(nn.Module):
    """1x1, 3x3 and 1x1 convolutions beside a shortcut, four times as wide at the end."""

    expansion = 4

    def __init__(self, inputs: int, width: int) -> None:
        super().__init__()
        outputs = width * self.expansion
        self.conv1, self.bn1 = convolution(1, inputs, width), nn.BatchNorm2d(width)
        self.conv2, self.bn2 = convolution(3, width, width), nn.BatchNorm2d(width)
        self.conv3, self.bn3 = convolution(1, width, outputs), nn.BatchNorm2d(outputs)
        self.downsample = _shortcut(inputs, outputs, 1)

    def forward(self, image: Float[Tensor, "B C H W"]) -> Float[Tensor, "B D H W"]:
        """Return the block's output."""
        inner = functional.relu(self.bn1(self.conv1(image)))
        inner = functional.relu(self.bn2(self.conv2(inner)))
        return functional.relu(self.bn3(self.conv3(inner)) + _short(self.downsample, image))


def _shortcut(inputs: int, outputs: int, stride: int) -> nn.Module | None:
    """Return a 1x1 convolution where the shape changes."""
    if stride == 1 and inputs == outputs:
        return None
    return normed(1, inputs, outputs, stride, relu=False)


def _short(shortcut: nn.Module | None, image: Tensor) -> Tensor:
    return image if shortcut is None else shortcut(image)

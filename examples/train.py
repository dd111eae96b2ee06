"""Trains a small network to find the strokes of the blocks in their prints, on the shards of `webdataset`.

    mocban -C blocks export --to webdataset --canvas 128 --split 80/10/10 --by block -o shards
    pip install torch webdataset pillow numpy
    python examples/train.py shards 10
"""

import sys
from pathlib import Path

import torch
import webdataset
from torch import nn


def batches(folder, part):
    """Yields batches of prints (3 channels from 0 to 1) and stroke masks (0 or 1)."""
    shards = sorted(str(path) for path in Path(folder).glob(f"{part}-*.tar"))
    pairs = webdataset.WebDataset(shards, shardshuffle=False).shuffle(100 if part == "train" else 0)
    pairs = pairs.decode("torchrgb").to_tuple("print.png", "aligned_mask.png")
    for prints, masks in torch.utils.data.DataLoader(pairs, batch_size=4):
        yield prints, (masks[:, :1] > 0.5).float()


torch.manual_seed(1)
first = nn.Conv2d(3, 16, 5, padding=2), nn.BatchNorm2d(16), nn.ReLU()
second = nn.Conv2d(16, 16, 5, padding=2), nn.BatchNorm2d(16), nn.ReLU()
network = nn.Sequential(*first, *second, nn.Conv2d(16, 1, 5, padding=2))
optimizer = torch.optim.Adam(network.parameters(), lr=1e-2)
for epoch in range(1, int(sys.argv[2]) + 1):
    for prints, masks in batches(sys.argv[1], "train"):
        loss = nn.functional.binary_cross_entropy_with_logits(network(prints), masks)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    with torch.no_grad():
        found = [(network(prints) > 0, masks > 0.5) for prints, masks in batches(sys.argv[1], "test")]
    iou = sum((a & b).sum() for a, b in found) / sum((a | b).sum() for a, b in found)
    print(f"epoch {epoch}: loss {loss:.4f}, IoU on the test blocks {iou:.3f}")

"""A PyTorch dataset of the aligned pairs of a project: strokes and ink in the frame of the print.

Install the wheel of a release, then:

    pip install pyarrow torch
    python torch_dataset.py demo
"""

import sys

import mocban
import torch


class AlignedPairs(torch.utils.data.Dataset):
    def __init__(self, folder, size=128, min_confidence=0.5):
        self.project, self.size = mocban.open(folder), size
        rows = self.project.pairs(["id", "confidence"]).to_pylist()
        self.ids = [row["id"] for row in rows if (row["confidence"] or 0) >= min_confidence]

    def __len__(self):
        return len(self.ids)

    def __getitem__(self, number):
        found = self.project.pair(self.ids[number]).alignment
        strokes, ink = found.results["relief"].aligned_mask(), found.print_mask()
        pair = torch.stack([torch.from_numpy(mask).float() for mask in (strokes, ink)])
        return torch.nn.functional.interpolate(pair[None], (self.size, self.size), mode="area")[0]


if __name__ == "__main__":
    dataset = AlignedPairs(sys.argv[1])
    # After a fork, mocban refuses to work: workers must be spawned.
    loader = torch.utils.data.DataLoader(dataset, batch_size=4, num_workers=2, multiprocessing_context="spawn")
    for batch in loader:
        print(tuple(batch.shape), f"{batch.mean():.3f}")

"""Reads prints as the program shows them."""

import numpy as np
from PIL import Image, ImageOps


def print_rgb(path):
    """Returns a print in 8-bit RGB: upright, with white in place of transparent pixels."""
    image = ImageOps.exif_transpose(Image.open(path))
    if image.mode.startswith("I;16"):
        # Pillow would clip 16 bits instead of scaling them.
        image = Image.fromarray(np.round(np.asarray(image) / 257).astype(np.uint8))
    image = image.convert("RGBA")
    return np.asarray(Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB"))

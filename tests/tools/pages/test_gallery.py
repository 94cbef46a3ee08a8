"""The gallery's pictures are those of its tool, and small."""

import io
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[3] / "host/docs"
TOOL = Path(__file__).parents[3] / "tools/pages/gallery.py"
pytest.importorskip("matplotlib")


def test_every_picture_of_the_page_is_made_by_the_tool_and_small():
    pictures = re.findall(r"\(img/([\w-]+)\.png\)", (DOCS / "gallery.md").read_text("utf-8"))
    assert len(pictures) >= 5
    for name in pictures:
        assert f'"{name}"' in TOOL.read_text("utf-8")
        assert (DOCS / "img" / f"{name}.png").stat().st_size < 100_000


def test_a_palette_keeps_the_picture():
    import numpy as np
    from PIL import Image

    from tools.pages import gallery

    picture = np.zeros((40, 60, 3), np.uint8)
    picture[10:20] = (11, 87, 208)
    raw = io.BytesIO()
    Image.fromarray(picture).save(raw, "png")
    compressed = np.asarray(Image.open(io.BytesIO(gallery.smaller(raw.getvalue()))).convert("RGB"))
    np.testing.assert_allclose(compressed, picture, atol=4)

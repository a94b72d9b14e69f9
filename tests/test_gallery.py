"""The gallery: the pictures of the documentation are what its script draws."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import flintknap as fk

DOCS = Path(__file__).parents[1] / "docs"
NUMBER = re.compile(r"(?<![\w#])-?\d+(?:\.\d+)?")


@pytest.fixture(scope="module")
def gallery():
    return runpy.run_path(str(DOCS / "gallery.py"))


def test_the_stored_pictures_are_those_of_the_script(gallery):
    drawn = gallery["pictures"]()
    for name, text in drawn.items():
        ElementTree.fromstring(text)
        stored = (DOCS / f"{name}.svg").read_text(encoding="utf-8")
        assert NUMBER.sub("0", stored) == NUMBER.sub("0", text), name
        # Cosines, of which some pictures are made, may differ by a last bit elsewhere.
        values = [np.array(NUMBER.findall(each), float) for each in (stored, text)]
        assert np.abs(values[0] - values[1]).max() < 0.02, name


def test_pictures_suit_light_and_dark_pages(gallery):
    for name, text in gallery["pictures"]().items():
        styles = "".join(re.findall("<style>(.*?)</style>", text, re.DOTALL))
        light = set(re.findall(r"\.(\w+) {[^}]*color: #", styles.split("@media")[0]))
        dark = set(re.findall(r"\.(\w+) { color: #", "".join(styles.split("@media")[1:])))
        assert light == dark, name
        used = set(re.findall('class="(\\w+)"', text))
        # Areas and dots are in the colour of their object.
        assert used - light <= {"flintknap", "area", "dots"}, name


def test_the_chalice(gallery):
    chalice = gallery["engine"](gallery["CHALICE"])
    assert len(chalice) == 77
    ring = chalice.boundary()
    assert (ring.status, ring.d) == ("closed", 0.0)
    # Whoever drew it drew it in this order.
    begin = int(np.flatnonzero(ring.ids == 0)[0])
    assert np.roll(ring.ids, -begin).tolist() == list(range(77))


def test_the_flint(gallery):
    flint = gallery["engine"](gallery["FLINT"])
    begin = int(np.flatnonzero(flint.boundary().ids == 0)[0])
    assert np.roll(flint.boundary().ids, -begin).tolist() == list(range(len(flint)))
    assert isinstance(flint, fk.Engine)
    assert not flint.smooth().crosses_itself

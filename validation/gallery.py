"""The decks of lammps_inputs/, each from a scene of validation/scenes/: `make gallery`."""

from __future__ import annotations

import re
from dataclasses import dataclass

import hertzchain as hc
from hertzchain.files import write_texts
from hertzchain.known.answer import Layout, deck, known_answer, lay_out
from validation.shipped import HERE, load

FOLDER = HERE.parent / "lammps_inputs"


@dataclass(frozen=True)
class Entry:
    """A deck of the gallery."""

    scene: str  # the scene file, without its suffix; the deck is ``in.`` and its name
    shows: str = ""  # what it is for, a cell of the README's table
    rtol: float = 1e-6  # relative error of the peaks by the step
    watch_every: int | None = None  # steps between two samples; None: as the generator chooses

    @property
    def name(self) -> str:
        """The name of the deck."""
        return f"in.{self.title}"

    @property
    def title(self) -> str:
        """The name of the scene, without its folder."""
        return self.scene.rpartition("/")[2]

    def load(self) -> hc.Scene:
        """The scene."""
        return load(self.scene)

    def layout(self, scene: hc.Scene) -> Layout:
        """The layout of the deck of the scene."""
        return lay_out(
            scene, rtol=self.rtol, watch_every=self.watch_every, title=self.title, name=self.name
        )

    def text(self) -> str:
        """The deck."""
        scene = self.load()
        layout = self.layout(scene)
        return deck(scene, layout, known_answer(scene, layout))


GALLERY = (
    Entry("demo", "the scene of `make demo`: a wave of 152 N runs off"),
    Entry("cosine_LM0.6_n6", "Table 2: cosine, LM_ratio 0.6, n 6; p = 5"),
    Entry("cosine_LM2.5_n8", "Table 2: cosine, LM_ratio 2.5, n 8; p = 9"),
    Entry("triangular_LM0.4_n10", "Table 2: triangular, LM_ratio 0.4, n 10; p = 5"),
    Entry("triangular_LM1.8_n6", "Table 2: triangular, LM_ratio 1.8, n 6; p = 8"),
    Entry("cosine-triangular_LM0.8_n8", "Table 2: cosine-triangular, LM_ratio 0.8, n 8; p = 5"),
    Entry("cosine-triangular_LM2.0_n2", "Table 2: cosine-triangular, LM_ratio 2.0, n 2; p = 9"),
    Entry("long_chain", "400 granules: the wave changes no more", rtol=1e-4, watch_every=2),
    Entry("pulse_table", "a measured pulse, row by row, that pushes twice"),
    Entry("weak_shock", "overlaps of 0.03 nm: softer granules keep the digits"),
    Entry("terms/dimer", "steel and PTFE by turns: contacts of two materials"),
    Entry("terms/taper", "each sphere is 3 % smaller than the one before"),
    Entry("terms/light_defect", "one light sphere rattles in a chain of steel"),
    Entry("terms/gapped", "gaps of 10 um: the spheres collide one after another"),
    Entry("terms/striker_on_a_wall", "a larger sphere hits a chain that ends at a rigid wall"),
    Entry("terms/precompressed", "20 N press the chain all the time"),
    Entry("terms/upright_column", "a sphere falls on a column on an elastic floor, under gravity"),
    Entry("terms/all_at_once", "two materials, a striker, an elastic wall, a load and gravity"),
    Entry("terms/damped", "damping: two spheres would part with 0.8 of their speed", rtol=1e-4),
    Entry("terms/damped_striker_on_a_wall", "viscoelastic contacts at a rigid wall", rtol=2e-4),
    Entry("terms/piston", "a piston moves at 0.1 m/s: waves follow one another"),
    Entry("terms/sine", "an actuator shakes a pressed chain"),
    Entry("terms/local_shock", "a pulse on granule 10 of a pressed chain: waves run both ways"),
    Entry("terms/clamped", "a sphere within a pressed chain and its end do not move"),
    Entry("terms/two_walls", "spheres are thrown at a near wall, for which a fixed sphere stands"),
)
"""The demo, the six scenes of Table 2, what else a deck can do, and each term. The long chain and
damped contacts are less exact: with fewer steps they run in seconds too."""


README = FOLDER / "README.md"
_HEAD = re.compile(r"Over F0, (\S+) N, they are expected to be (.+?), right to (\S+?)\. ")
_TABLE = re.compile(r"^\| deck \|.*?\n\n", re.DOTALL | re.MULTILINE)


def table(texts: dict[str, str]) -> str:
    """Return the README's table of decks by their names: peaks over F0, from the decks' heads."""
    lines = ["| deck | what it shows | F0 [N] | contacts 2, 3, 4, ..., last | right to |"]
    lines.append("|---|---|---|---|---|")
    for entry in GALLERY:
        head = re.sub(r"\n# ?", " ", texts[entry.name].partition("# ----")[0])
        match = _HEAD.search(head)
        assert match is not None, entry.name
        lines.append(f"| `{entry.name}` | {entry.shows} | {' | '.join(match.groups())} |")
    return "\n".join(lines) + "\n\n"


def readme(texts: dict[str, str]) -> str:
    """Return the README of the folder with the table of these decks."""
    return _TABLE.sub(lambda _: table(texts), README.read_text(encoding="utf-8"), count=1)


if __name__ == "__main__":
    decks = {entry.name: entry.text() for entry in GALLERY}
    write_texts({**{FOLDER / name: text for name, text in decks.items()}, README: readme(decks)})

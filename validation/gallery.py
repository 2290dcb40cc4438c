"""The decks of lammps_inputs/, each from a scene of validation/scenes/: `make gallery`."""

from __future__ import annotations

from dataclasses import dataclass

import hertzchain as hc
from hertzchain.decks.known_answer import known_answer, lay_out
from hertzchain.decks.layout import Layout
from hertzchain.decks.standalone import standalone
from hertzchain.files import write_texts
from validation.shipped import HERE, load

FOLDER = HERE.parent / "lammps_inputs"


@dataclass(frozen=True)
class Entry:
    """A deck of the gallery."""

    scene: str  # the scene file, without its suffix; the deck is ``in.`` and its name
    rtol: float = 1e-6  # what the step may cost the peaks
    watch_every: int | None = None  # steps between two looks; None: as many as the generator takes

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
        return standalone(scene, layout, known_answer(scene, layout))


GALLERY = (
    Entry("demo"), Entry("cosine_LM0.6_n6"), Entry("cosine_LM2.5_n8"),
    Entry("triangular_LM0.4_n10"), Entry("triangular_LM1.8_n6"),
    Entry("cosine-triangular_LM0.8_n8"), Entry("cosine-triangular_LM2.0_n2"),
    Entry("long_chain", rtol=1e-4, watch_every=2), Entry("pulse_table"), Entry("weak_shock"),
    Entry("terms/dimer"), Entry("terms/taper"), Entry("terms/light_defect"),
    Entry("terms/gapped"), Entry("terms/striker_on_a_wall"), Entry("terms/precompressed"),
    Entry("terms/upright_column"), Entry("terms/all_at_once"),
    Entry("terms/damped", rtol=1e-4), Entry("terms/damped_striker_on_a_wall", rtol=2e-4),
    Entry("terms/piston"), Entry("terms/sine"),
)  # fmt: skip
"""The demo, the six scenes of Table 2, what else a deck can do, and each term. The long chain and
damped contacts are less exact: with fewer steps they run in seconds too."""


if __name__ == "__main__":
    write_texts({FOLDER / entry.name: entry.text() for entry in GALLERY})

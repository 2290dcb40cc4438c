"""Spectra of forces, and band edges against eigenvalues and against the spectra of runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hertzchain as hc
from hertzchain.errors import SceneError
from hertzchain.pulses.spectrum import Spectrum, band_edges, spectrum_of, times_of
from tests.command_line import Command
from tests.conftest import STEEL

SIZE, LIGHT = 40, 2000.0  # granules; density of the lighter ones [kg/m^3]
PRESSED = hc.Scene(
    hc.Chain(SIZE, **STEEL), hc.Pulse("cosine", 1.0, 2.0, rise_time=5e-6),
    precompression=hc.Precompression(20.0), run=hc.Run(0.01),
)  # fmt: skip
ALIKE = {key: [value] * SIZE for key, value in STEEL.items()}
DIMER = replace(
    PRESSED,
    chain=hc.Chain(SIZE, **(ALIKE | {"density": [STEEL["density"], LIGHT] * (SIZE // 2)})),
)


def measured(scene: hc.Scene, contact: int = 7) -> Spectrum:
    run = hc.Native(wanted="all").run(scene, times_of(scene))
    return spectrum_of(run, hc.Gauge(contact=contact))


@pytest.mark.parametrize("scene", [PRESSED, DIMER], ids=["alike", "dimer"])
def test_bands_end_where_a_run_has_no_waves_any_more(scene: hc.Scene) -> None:
    """Within a bin: amplitudes above a hundredth of the largest are more than leaks from a sine."""
    spectrum = measured(scene)
    is_wave = spectrum.amplitude > 0.01 * spectrum.amplitude.max()
    frequency, width = spectrum.frequency, spectrum.frequency[1]
    for edge in spectrum.edges:
        side = -1 if edge.name.startswith("end") else 1
        inside = side * (frequency - edge.frequency)
        near = is_wave & (np.abs(inside) < 20 * width)
        assert np.min(inside[near]) == pytest.approx(0.0, abs=width)


@pytest.mark.parametrize("scene", [PRESSED, DIMER], ids=["alike", "dimer"])
def test_band_edges_are_frequencies_of_a_ring(scene: hc.Scene) -> None:
    """Eigenvalues of the linear equations of four granules, whose ring has q = 0 and pi."""
    mass = np.resize(scene.granules.mass[1:3], 4)
    stretch = (20.0 / scene.granules.stiffness[1]) ** (2 / 3)
    k = 1.5 * 20.0 / stretch  # dF/d(overlap) of Hertz's law
    ring = k * (2 * np.eye(4) - np.roll(np.eye(4), 1, 0) - np.roll(np.eye(4), -1, 0))
    squares = np.linalg.eigvals(ring / mass[:, None]).real
    modes = np.sqrt(np.abs(squares)) / (2 * np.pi)
    for edge in band_edges(scene):
        assert np.min(np.abs(modes / edge.frequency - 1)) < 1e-9
    assert max(edge.frequency for edge in band_edges(scene)) == pytest.approx(modes.max())


def test_a_sine_has_its_amplitude() -> None:
    """A record of 0.3 N at 5 kHz in the middle of a bin, in the place of a run's force."""
    run = hc.Native(wanted="all").run(PRESSED, times_of(PRESSED))
    assert run.history is not None
    force = 20.0 + 0.3 * np.sin(2 * np.pi * 5e3 * run.history.time)
    contacts = np.repeat(force[:, None], SIZE - 1, axis=1)
    sine = replace(run, history=replace(run.history, contact_force=contacts))
    spectrum = spectrum_of(sine, hc.Gauge(contact=7))
    frequency, amplitude = spectrum.largest
    assert frequency == pytest.approx(5e3, abs=spectrum.frequency[1])
    assert amplitude == pytest.approx(0.3, rel=0.01)
    leaks = Spectrum(PRESSED, hc.Gauge(contact=7), np.arange(3.0), np.array([3.0, 1.0, 2.0]), ())
    assert leaks.largest == (2.0, 2.0)  # the mean is subtracted before the window: 0 Hz is no wave


def test_chains_without_bands(hertzchain: Command, tmp_path: Path) -> None:
    loose = replace(PRESSED, precompression=None)
    few = replace(PRESSED, chain=hc.Chain(4, **STEEL))
    three = [STEEL["density"], STEEL["density"], LIGHT]
    trimer = hc.Chain(SIZE, **(ALIKE | {"density": np.resize(three, SIZE).tolist()}))
    hanging = hc.Precompression(20.0, gravity=9.8)
    heavy = replace(PRESSED, precompression=hanging, wall=hc.Wall("same"))
    for scene in (loose, few, replace(PRESSED, chain=trimer), heavy):
        assert band_edges(scene) == ()
    with pytest.raises(SceneError, match="give an earlier end_time"):
        times_of(replace(PRESSED, run=hc.Run(100.0)))
    with pytest.raises(SceneError, match="must be a run with record"):
        spectrum_of(hc.Native().run(loose), hc.Gauge(contact=7))
    PRESSED.to_toml(tmp_path / "pressed.toml")
    for gauge, words in (
        ("0", "from 2"),
        ("41", "to 40"),
        ("wall", "not a gauge"),
        ("six", "--gauge"),
    ):
        refused = hertzchain("spectrum", tmp_path / "pressed.toml", "--gauge", gauge)
        assert (refused.status, refused.out) == (2, "")
        assert words in refused.err


def test_the_command(hertzchain: Command, tmp_path: Path) -> None:
    DIMER.to_toml(tmp_path / "dimer.toml")
    given = ("spectrum", tmp_path / "dimer.toml", "--gauge")
    said = hertzchain(*given, "6", "--plot", tmp_path / "spectrum.png", "--size", "3.4x2.6")
    assert said.status == 0, said.err
    for words in ("granule 6, without its mean", "Hann, over the whole", "sqrt(2k/M)"):
        assert words in said.out
    assert (tmp_path / "spectrum.png").stat().st_size > 5000
    document = hertzchain(*given, "contact_7", "--json").json()
    assert document["gauge"] == "contact 7"
    assert len(document["frequency_Hz"]) == len(document["amplitude_N"])
    assert [edge["name"][:3] for edge in document["band_edges"]] == ["end", "sta", "end"]

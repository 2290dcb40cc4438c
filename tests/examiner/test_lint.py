"""Lint: every planted trap is found, right decks get no finding, and no text breaks it."""

from __future__ import annotations

import re
import tempfile
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from _pytest.mark.structures import ParameterSet
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzchain as hc
from hertzchain.arrays import FloatArray
from hertzchain.engines.lammps.dialect import NO_FRICTION, PAIR_STYLES
from hertzchain.engines.lammps.engine import command, engine
from hertzchain.engines.lammps.reading import reading
from hertzchain.errors import HertzchainError, TooExpensive
from hertzchain.examiner.lint import RULES, Finding, findings, lint_file, script_of
from hertzchain.examiner.lint import TRAPS as COMMAND_TRAPS
from hertzchain.known.answer import KnownAnswer, Layout, deck
from tests import scenes
from tests.command_line import Command
from tests.effort import effort
from tests.places import ROOT

CLEAN, HEAP, PLANTED = (
    Path(__file__).with_name(name).read_text(encoding="utf-8")
    for name in ("in.clean", "in.heap", "traps.toml")
)
ROOM = "$(-2*v_R) $(2*v_R) $(-2*v_R) $(2*v_R)"
DIAMETER, DENSITY = "set group all diameter $(2*v_R)\n", "set group all density 7958\n"


@dataclass(frozen=True)
class Trap:
    """A mistake: what has to be found, its effect as ``traps.toml`` has it, and its changes."""

    rule: str
    severity: str
    effect: str
    by: float
    changes: tuple[str, ...]


TRAPS = {
    name: Trap(rule, severity, effect, by, tuple(changes))
    for name, (rule, severity, effect, by, *changes) in tomllib.loads(PLANTED).items()
}


def planted(trap: Trap, text: str = CLEAN) -> str:
    for old, new in zip(trap.changes[::2], trap.changes[1::2], strict=True):
        assert old in text
        text = text.replace(old, new)
    return text


def lint(text: str, variables: dict[str, str] | None = None) -> list[Finding]:
    """The findings in a text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "in.chain"
        path.write_text(text, encoding="utf-8")
        return lint_file(path, variables)


def bad(findings: list[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity != "note"]


NAMES = {*RULES, *(trap.rule for trap in COMMAND_TRAPS)}

FIRST = {trap.rule: name for name, trap in reversed(TRAPS.items())}
"""A trap of each rule: those that the default suite looks for."""


def each(names: Iterable[str]) -> list[ParameterSet]:
    quick = set(FIRST.values())
    return [pytest.param(k, marks=[] if k in quick else [pytest.mark.slow]) for k in names]


@pytest.mark.lammps
@pytest.mark.parametrize("name", each(TRAPS))
def test_a_planted_trap_is_found(name: str) -> None:
    trap = TRAPS[name]
    text = planted(trap)
    findings = lint(text)
    assert (trap.rule, trap.severity) in {(f.rule, f.severity) for f in findings}
    assert all(1 <= finding.line <= len(text.splitlines()) for finding in findings)


def test_every_rule_has_a_planted_trap() -> None:
    elsewhere = {"no-deck", "no-run", "elsewhere", "no-chain"}  # tests of their own
    assert {trap.rule for trap in TRAPS.values()} | elsewhere == NAMES


def peaks(text: str) -> FloatArray:
    """The peak force of each contact, from forces every tenth step, shape (contacts,)."""
    samples: list[FloatArray] = []
    with engine() as lammps:
        for line in re.sub(r"&\n", "", text).splitlines():
            words = line.split("#")[0].split()
            if words[:1] != ["run"]:
                command(lammps, line)
                continue
            for k in range(int(words[1]) // 10):
                command(lammps, f"run 10 pre {'no' if k else 'yes'} post no")
                order = np.argsort(lammps.numpy.extract_atom("id")[: lammps.get_natoms()])
                force = np.array(lammps.numpy.extract_atom("f"))[order, 0]
                # What presses contact i is what moves all granules behind it.
                samples.append(np.cumsum(force[::-1])[::-1][1:])
    peak: FloatArray = np.max(samples, axis=0)
    return peak


@pytest.fixture(scope="module")
def clean_peaks() -> FloatArray:
    return peaks(CLEAN)


@pytest.mark.lammps
@pytest.mark.parametrize("name", each(n for n, trap in TRAPS.items() if trap.effect == "peaks"))
def test_a_trap_moves_the_peaks(name: str, clean_peaks: FloatArray) -> None:
    moved = np.abs(peaks(planted(TRAPS[name])) / clean_peaks - 1)[:20]
    assert np.max(moved) > TRAPS[name].by


@pytest.mark.lammps
@pytest.mark.parametrize("name", [n for n, trap in TRAPS.items() if trap.effect == "stops"])
def test_lammps_stops_at_a_trap(name: str) -> None:
    with pytest.raises(HertzchainError), engine() as lammps:
        command(lammps, planted(TRAPS[name]))


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("run 1000", "run", "run", "run needs at least 1 word more"),
        ("first addforce v_push", "first addforce v_f", "run 1000", "Variable f for fix addforce"),
        ("equal 50*(1", "equal v_F*(1", "run 1000", "reference v_F in"),
        ("units si", "include missing", "include", "cannot be read"),
        ("run 3000", "run ${n}", "run ${n}", "illegal variable n"),
    ],
)
def test_a_deck_that_lammps_refuses_is_an_error(old: str, new: str, line: str, said: str) -> None:
    """At the line where LAMMPS stops."""
    text = CLEAN.replace(old, new)
    findings = [finding for finding in lint(text) if finding.rule == "text-alone"]
    assert [finding.severity for finding in findings] == ["error"]
    assert said in findings[0].text
    assert "in.chain" not in findings[0].text  # the place is that of the finding
    assert text.split("\n")[findings[0].line - 1].startswith(line)


MODEL = "hertz/material 193e9 0.0 0.3 &\n    tangential linear_nohistory 0.0 0.0"
TIME = (np.pi / 6 * 0.0095**3 * 7958) ** 0.5 / (
    (4 / 3 * 193e9 / (2 * (1 - 0.3**2)) * (0.0095 / 4) ** 0.5) ** (1 / 3) * 100 ** (1 / 6)
)
"""Natural time of its contacts, under 100 N [s]."""
LOOP = """\
variable i loop 30
label more
variable x equal (v_i-1)*2*v_R
create_atoms 1 single ${x} 0 0 units box
next i
jump SELF more
"""
MDR, STEP, NO_RUN = "mdr 5e6 0.4 1.9e5 2.0 0.5 0.5", "timestep 5e-8", r"re:(?m)^run .*\n=>"
DAMPED = ["attraction warning", "damping note"]
NO_PLANE = "boundary f f f=>boundary p p p"


def stepped(step: float) -> str:
    """A step, in natural time units, as a change of the clean deck."""
    little = "fix little first addforce 1e-3 0.0 0.0\n"
    return f"unfix shock\nrun 3000=>{little}timestep {step * TIME!r}\nrun 100"


def moving(said: str, lattice: str = "") -> list[str]:
    command = "fix led first move" if said.startswith("linear") else "velocity first"
    of_lattice = [f"set group all diameter=>{lattice}\nset group all diameter"] if lattice else []
    return [f"{STEP}=>{command} {said}\n{STEP}", *of_lattice]


def in_a_box(x: float, y: float, flat: bool = False) -> list[str]:
    z = "-1e-4 1e-4" if flat else "-0.1 0.1"
    box = f"$(-{x}*v_R) $(2*v_R*v_N+{x}*v_R) $(-{y}*v_R) $({y}*v_R) {z}"
    is_flat = ["boundary=>dimension 2\nboundary", "lattice sc=>lattice sq"] if flat else []
    return [NO_PLANE, f"$(-2*v_R) $(2*v_R*(v_N+1)) {ROOM}=>{box}", *is_flat]


SAID: list[tuple[list[str], list[str]]] = [
    ([], []),
    (["run 1000=>" + DIAMETER + DENSITY + "run 1000"], []),
    ([f"{DIAMETER}{DENSITY}=>{DENSITY}{DIAMETER}{DENSITY}"], []),
    ([NO_RUN], ["no-run note"]),
    (["run 3000=>runn 3000", NO_RUN], ["no-run note", "text-alone warning"]),
    ([NO_RUN, r're:\Z=>if "1 > 0" then "run 10"\n'], []),
    # What a part of a deck lacks may stand elsewhere.
    ([NO_RUN, "variable N equal 30\n=>", r"re:(?s)fix motion.*=>"],
     ["no-run note", "text-alone note"]),
    (moving("set 1.0 0.0 0.0"), ["lattice-units warning"]),
    (moving("set 1.0 0.0 0.0", "lattice none 1.0"), []),
    (moving("set 1.0 0.0 0.0 units box"), []), (moving("set 0 NULL 0.0"), []),
    (moving("set v_push 0.0 0.0"), ["text-alone error"]),
    (moving("ramp vx 0.0 1.0 x 0 1"), ["lattice-units warning"]),
    (moving("linear 1.0 0.0 0.0"), ["lattice-units warning"]),
    (moving("linear 1.0 0.0 0.0", "lattice none 1.0"), []),
    (moving("linear 1.0 0.0 0.0 units box"), []),
    ([stepped(0.198)], []), ([stepped(0.202)], ["step-length warning"]),
    # E, damping and Poisson's ratio in another order: below a hundredth it is a damping.
    (["193e9 0.0 0.3=>193e9 0.3 0.003"], ["poisson-ratio warning"]),
    (["193e9 0.0 0.3=>193e9 0.3 0.03"], []),
    # 1e-7 of the contact force, where granules part the fastest, is at 0.656 / (m s).
    (["193e9 0.0 0.3=>193e9 0.64 0.3"], []), (["193e9 0.0 0.3=>193e9 0.68 0.3"], DAMPED),
    ([f"{MODEL}=>{MDR}"], ["not-hertz warning", "text-alone error"]),
    (["create_atoms 1 region chain\n=>" + LOOP], []),
    (["create_atoms 1 region chain\n=>" + LOOP, "boundary f f f=>"], ["periodic warning"] * 2),
    # A chain far from its images may be periodic; of flat decks LAMMPS wants it in z.
    (in_a_box(3, 3), []), (in_a_box(3, 2), ["periodic warning"]),
    (in_a_box(1, 3), ["periodic warning"]), (in_a_box(3, 3, flat=True), []),
    (in_a_box(3, 2, flat=True), ["periodic warning"]),
]  # fmt: skip
"""Changes of the clean deck, as old => new text, and the rules and severities of what is said."""


@pytest.mark.lammps
@pytest.mark.parametrize("row", range(len(SAID)))
def test_what_is_said_of_a_deck(row: int) -> None:
    changes, said = SAID[row]
    text = CLEAN
    for old, _, new in (change.partition("=>") for change in changes):
        if old.startswith("re:"):
            text = re.sub(old[3:], new, text)
        else:
            assert old in text
            text = text.replace(old, new)
    assert [f"{finding.rule} {finding.severity}" for finding in lint(text)] == said


MORE_WORDS = 'set fix run if variable jump label next ${R} $(v_R) $( & # " \' """ v_push * 0 -1 nan'
WORDS = sorted(set((CLEAN + HEAP + MORE_WORDS).split()))


def of_text(text: str) -> list[Finding]:
    """The findings in a text alone."""
    return findings(script_of(Path("in.chain"), text))


def has_findings(text: str) -> None:
    assert all(finding.rule in NAMES and finding.line >= 1 for finding in of_text(text))


CHANGES = st.lists(st.tuples(st.integers(0, 400), st.sampled_from(["", "drop", "twice", *WORDS])))


def changed(changes: list[tuple[int, str]], text: str) -> str:
    pieces = re.split(r"(\s+)", text)
    for place, new in changes:
        at = place % len(pieces)
        pieces[at] = {"drop": "", "twice": pieces[at] * 2}.get(new, new)
    return "".join(pieces)


@pytest.mark.parametrize("examples", [30, pytest.param(2000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "texts", [st.text(max_size=300), st.builds(changed, CHANGES, st.sampled_from([CLEAN, HEAP]))]
)
def test_any_text_gives_findings_or_none(texts: st.SearchStrategy[str], examples: int) -> None:
    settings(max_examples=examples)(given(texts)(has_findings))()


HOSTILE = (
    '"' * 50_000, '"""' + "x\n" * 25_000, "&\n" * 25_000, "print $(" * 5_000, "((((" * 12_500,
    "variable a equal v_a\n" * 5_000, "set group all density 1\n" * 1_250,
    "fix a all addforce v_f 0 0\nrun 1\n" * 250, "label a\n" * 5_000 + "jump SELF a\n",
)  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE, ids=lambda text: text[:12].split("\n")[0])
def test_a_hostile_text_is_soon_read(text: str) -> None:
    assert effort(lambda: of_text(text)) < 50  # 1.6 at most measured; it goes as the length


def test_files_that_cannot_be_read_are_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(HertzchainError, match="cannot be read"):
        lint_file(tmp_path / "none")
    with pytest.raises(HertzchainError, match="cannot be read"):
        lint_file(tmp_path)
    latin = tmp_path / "in.latin"  # comments may be in another encoding
    latin.write_bytes("# Stoß\n".encode("latin-1") + CLEAN.encode())
    assert lint_file(latin) == []
    large = tmp_path / "in.large"
    large.write_bytes(b"run 1\n" * 1_000_000)
    with pytest.raises(HertzchainError, match="larger than 5 MB"):
        lint_file(large)


def test_a_pair_style_that_is_no_contact_law_is_named() -> None:
    (finding,) = (f for f in lint(planted(TRAPS["atoms"])) if f.rule == "not-hertz")
    assert finding.text.startswith("pair_style lj/cut is not a contact of spheres")


def test_text_that_is_no_deck_is_named() -> None:
    assert [f.rule for f in bad(lint("Dear all,\nplease find attached.\n"))] == ["no-deck"]
    # An empty variable, which a command line refuses, is read.
    assert [finding.rule for finding in lint("print ${a}\n", {"a": ""})] == ["no-deck"]


def test_a_deck_that_is_not_read_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its text is still examined."""

    def late(_: Path, __: dict[str, str], time_limit: float) -> None:
        raise TooExpensive(f"{time_limit}")

    monkeypatch.setattr("hertzchain.engines.lammps.reading.reading.look", late)
    deck = tmp_path / "in.late"
    deck.write_text(planted(TRAPS["density first"]), encoding="utf-8")
    first, *others = lint_file(deck, {}, 5.0)
    assert first.text == "not read to its end in 5 s: shorten its loops, or raise the limit"
    assert [finding.rule for finding in others] == ["density-before-diameter"]


def test_the_command(tmp_path: Path, hertzchain: Command) -> None:
    good, wrong = tmp_path / "in.good", tmp_path / "in.wrong"
    good.write_text(CLEAN, encoding="utf-8")
    wrong.write_text(planted(TRAPS["density first"]), encoding="utf-8")
    clean = hertzchain("lint", good)
    assert (clean.status, clean.out) == (0, "0 errors, 0 warnings, 0 notes\n")
    outcome = hertzchain("lint", good, wrong)
    assert outcome.status == 1
    assert outcome.out.startswith(f"{wrong}:15: error: the density is set before the diameter")
    assert outcome.out.endswith("[density-before-diameter]\n1 error, 0 warnings, 0 notes\n")
    decks = hertzchain("lint", "--json", good, wrong).json()["decks"]
    assert [len(deck["findings"]) for deck in decks] == [0, 1]
    assert decks[1]["findings"][0]["line"] == 15
    missing = hertzchain("lint", tmp_path / "none")
    assert (missing.status, missing.err.count("\n")) == (2, 1)
    damped = planted(TRAPS["damped"]).replace("damping velocity", "damping velocity limit_damping")
    good.write_text(damped, encoding="utf-8")
    noted = hertzchain("lint", good)
    assert (noted.status, ": note: " in noted.out) == (0, True)


def test_included_files_are_looked_at(tmp_path: Path) -> None:
    """As parts of the deck, and named where something is wrong in them; none without end."""
    wrong = planted(TRAPS["density first"])
    setup, rest = wrong[: wrong.index("neighbor")], wrong[wrong.index("neighbor") :]
    at = setup.partition("set group all density")[0].count("\n") + 1
    (tmp_path / "setup.in").write_text(setup, encoding="utf-8")
    (tmp_path / "more.in").write_text("include setup.in\n", encoding="utf-8")
    file = tmp_path / "in.chain"
    file.write_text(f"# a chain\ninclude more.in  # made there\n{rest}", encoding="utf-8")
    (finding,) = bad(lint_file(file))
    assert (finding.line, finding.rule) == (2, "density-before-diameter")
    assert finding.text.startswith(f"setup.in:{at}: the density is set before the diameter")
    (tmp_path / "setup.in").write_text(CLEAN[: CLEAN.index("neighbor")], encoding="utf-8")
    assert lint_file(file) == []
    file.write_text("include none.in\ninclude in.chain\nrun 1\n", encoding="utf-8")
    assert {finding.rule for finding in lint_file(file)} >= {"elsewhere"}


def test_variables_of_the_command_line(tmp_path: Path, hertzchain: Command) -> None:
    """As LAMMPS takes them: in place of the values of style index."""
    step = re.search(r"^timestep .*$", CLEAN, flags=re.MULTILINE)
    text = CLEAN.replace(step[0], "variable dt index 1.0\ntimestep ${dt}")
    assert "step-length" in {finding.rule for finding in bad(lint(text))}
    assert bad(lint(text, {"dt": step[0].split()[1]})) == []
    file = tmp_path / "in.chain"
    file.write_text(text, encoding="utf-8")
    assert hertzchain("lint", file).status == 1
    assert hertzchain("lint", file, "--var", f"dt={step[0].split()[1]}").status == 0
    refused = hertzchain("lint", file, "--var", "n=")
    assert (refused.status, refused.err.count("\n")) == (2, 1)


# Whole decks: right ones, ones in another style, and ones that are not chains

ASKED = reading.look


@pytest.fixture(autouse=True)
def _asked_here(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Asks LAMMPS in this process: a second less."""

    def here(path: Path, given: dict[str, str], _: float) -> reading.Look:
        start = reading.Start(tmp_path_factory.mktemp("LAMMPS"), None, alone=False)
        return reading.looked(start, path, Path.cwd(), given)

    monkeypatch.setattr(reading, "look", here)


LAW = "hertz/material 1e7 0.5 0.3 tangential mindlin NULL 1.0 0.5 damping tsuji"
CLASSIC = "hooke/history 2000.0 NULL 50.0 NULL 0.5 0"

HEAD = f"""\
units si
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
region box block 0 1 0 1 0 1
create_box 2 box
region part block 0.2 0.8 0.2 0.8 0.6 0.9
pair_style gran/{CLASSIC}
pair_coeff * *
neigh_modify delay 0 every 1 check no
neighbor 0.01 bin
timestep 1e-5
fix move all nve/sphere
fix down all gravity 9.81 vector 0 0 -1
"""

RANDOM = """\
create_atoms 1 random 40 12345 part
create_atoms 2 random 40 54321 part
set group all diameter 0.05
set group all density 2500
"""

POUR = "fix rain all pour 100 1 3123 region part\nrun 1000\nunfix rain\nrun 1000\n"

LIGGGHTS = """\
units si
atom_style granular
boundary f f f
newton off
communicate single vel yes
region box block -0.5 0.5 -0.5 0.5 0 1 units box
create_box 1 box
neighbor 0.004 bin
fix m1 all property/global youngsModulus peratomtype 5.e6
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix down all gravity 9.81 vector 0.0 0.0 -1.0
"""

OLD = "pair_style gran/hertz/history 1 0"
"""The pair style of LIGGGHTS before its models had names: two switches, no stiffness."""

POURED, VESSEL, BODIES = (
    "granules are poured",
    "granules lie in a vessel",
    "rigid bodies of several",
)

OTHERS = {
    "pour": (POURED, HEAD + POUR),
    "a mixture": (POURED, HEAP),
    "deposit": (POURED, HEAD + POUR.replace("pour 100 1", "deposit 100 1 50")),
    "vessel": (VESSEL, HEAD + f"fix v all wall/gran/region granular {LAW} region part\nrun 1000\n"),
    "chute": ("granules are frozen", HEAD.replace("vector 0 0 -1", "chute 26.0")
        + "read_data data.chute\ngroup bottom type 2\nfix 2 bottom freeze\nrun 1000\n"),
    "rigid bodies": (BODIES, HEAD.replace("fix move all nve/sphere\n", "")
        + "read_data clumps\nfix body all rigid molecule\nrun 10\n"),
    "bonded": ("granules are bonded", HEAD.replace("atom_style sphere", "atom_style bpm/sphere")
        + "create_atoms 1 box\nset group all diameter 1 mass 1.0\nbond_style bpm/rotational\n"
        "run 100\n"),
    "two-dimensional": ("it is two-dimensional", "dimension 2\n" + HEAD
        + "create_atoms 1 region part\nset group all diameter 0.1 density 2500\n"
        "fix 2 all enforce2d\nrun 10\n"),
    "one granule on a plate": ("it has one granule", HEAD + "create_atoms 1 single 0.5 0.5 0.5\n"
        "set group all diameter 0.1\nset group all density 2500\n"
        f"fix plate all wall/gran {CLASSIC} zplane 0 NULL\nrun 100\n"),
    "atoms": ("its atoms are not spheres", HEAD.replace("atom_style sphere", "atom_style atomic")),
    "12,000 granules": ("12000 granules do not lie", HEAD.replace("p p f", "p p p")
        + RANDOM.replace("random 40", "random 6000").replace("0.05", "0.002") + "run 100\n"),
    "meshes": (VESSEL, LIGGGHTS + "fix m all mesh/surface file a.stl type 1\nfix w all wall/gran"
        " model hertz tangential history mesh n_meshes 1 meshes m\nfix i all nve/sphere\nrun 10\n"),
    "insert": (POURED, LIGGGHTS + "fix i all insert/stream seed 1\nfix m all nve/sphere\nrun 9\n"),
    "pack": (POURED, LIGGGHTS.replace("granular", "sphere") + "fix t all particletemplate/"
        "multisphere 1 nspheres 4\nfix i all insert/pack seed 1\nfix m all multisphere\nrun 9\n"),
    "old LIGGGHTS": (POURED, LIGGGHTS.replace("pair_style gran model hertz tangential history", OLD)
        + "fix m all nve/sphere\nfix w all wall/gran/hertz/history 1 0 zplane 0 NULL 1\n"
        "fix i all pour/dev nparticles 600 massrate 0.1 1\nrun 9\n"),
}  # fmt: skip
"""Words for decks that are not chains, and decks as they are published."""

OF_LIGGGHTS = {"meshes", "insert", "pack", "old LIGGGHTS"}


@pytest.mark.lammps
@pytest.mark.parametrize("name", OTHERS)
def test_a_deck_that_is_no_chain_is_said_to_be_none_and_has_no_error(name: str) -> None:
    """Whatever traps are in it, too."""
    why, text = OTHERS[name]
    findings = lint(text.replace("fix down", "fix again all nve/sphere\nfix down"))
    (said,) = [finding.text for finding in findings if finding.rule == "no-chain"]
    assert why in said
    assert {finding.severity for finding in findings} == {"note"}
    assert any("for LIGGGHTS" in finding.text for finding in findings) == (name in OF_LIGGGHTS)
    is_partial = any(f.text.startswith("LAMMPS read a part of the deck") for f in findings)
    assert is_partial or name != "chute"  # its file is missing


ROWS = """\
units si
atom_style sphere
boundary p f f
comm_modify vel yes
newton off
lattice sc 0.01
region box block 0 20 -2 6 -2 2
create_box 1 box
region rows block 0 19.5 0 3 0 0
create_atoms 1 region rows
set group all diameter 0.01
set group all density 2500
neighbor 0.002 bin
pair_style gran/hertz/history 1e9 NULL 0.0 NULL 0.0 0
pair_coeff * *
timestep 1e-6
fix 1 all nve/sphere
fix 2 all momentum 1 linear 1 1 1
group one id 1
velocity one set 0.1 0 0 units box
run 1000
"""


@pytest.mark.lammps
@pytest.mark.parametrize(
    ("rows", "said"),
    [("0 3", {("no-chain", "note")}), ("0 0", {("periodic", "warning")})],
    ids=["rows", "ring"],
)
def test_rows_and_rings_are_told_by_their_granules(rows: str, said: set[tuple[str, str]]) -> None:
    findings = lint(ROWS.replace("19.5 0 3", f"19.5 {rows}"))
    assert {(finding.rule, finding.severity) for finding in findings} == said


STYLES = {
    "two-dimensional": "boundary f f f|lattice sc|fix motion all nve||dimension 2\nboundary f f p|"
    "lattice sq|fix motion all nve/sphere\nfix plane all enforce2d",
    "in a tube": "fix motion||region tube cylinder x 0 0 0.005 INF INF\nfix tube all"
    f" wall/gran/region granular hertz 1e11 0.0 {NO_FRICTION} region tube\nfix motion",
    "last granule frozen": "fix motion all||group last id 30\ngroup free subtract all last\n"
    "fix held last freeze\nfix motion free",
    "hybrid": "pair_style granular|pair_coeff * *||pair_style hybrid/overlay granular zero 0.01|"
    "pair_coeff * * zero\npair_coeff * * granular",
}
"""Chains in other styles: texts of the clean deck, and those in their place."""


@pytest.mark.lammps
@pytest.mark.parametrize("name", STYLES)
def test_a_chain_in_another_style_is_a_chain(name: str) -> None:
    text = CLEAN
    old, new = (part.split("|") for part in STYLES[name].split("||"))
    for word, other in zip(old, new, strict=True):
        assert word in text
        text = text.replace(word, other)
    assert lint(text) == []
    pushed = lint(text.replace("group first id 1\n", "group first id 1:3\n"))
    assert {finding.rule for finding in pushed} == {"force-on-all"}


@pytest.mark.lammps
def test_without_lammps_the_text_is_read(
    tmp_path: Path, hertzchain: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reading, "look", ASKED)  # in a process of its own, as users do
    monkeypatch.syspath_prepend(ROOT / "tests" / "no_lammps")
    file = tmp_path / "in.chain"
    file.write_text(planted(TRAPS["density first"]), encoding="utf-8")
    done = hertzchain("lint", file)
    note, *rest = done.out.splitlines()
    assert note.startswith(f"{file}:1: note: LAMMPS could not be asked")
    assert "lammps" in note
    assert [line.split("[")[-1] for line in rest[:-1]] == ["density-before-diameter]"]
    assert (done.status, rest[-1]) == (1, "1 error, 0 warnings, 1 note")


# Right decks

SHIPPED = sorted((ROOT / "lammps_inputs").glob("in.*"))

MEANT = {
    "in.damped": ["damping"],
    "in.damped_striker_on_a_wall": ["damping"] * 4,
    "in.gapped": ["not-touching"],
}
"""Findings in shipped decks whose granules are apart, pressed or damped on purpose."""


@pytest.mark.lammps
@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (p.name != "in.demo")) for p in SHIPPED],
    ids=lambda path: path.name,
)
def test_nothing_else_is_said_of_shipped_decks(path: Path) -> None:
    assert [finding.rule for finding in lint_file(path)] == MEANT.get(path.name, [])


def generated(scene: hc.Scene, pair_style: str = "granular") -> str:
    """Return a deck of a scene; its expected peaks do not matter here."""
    ones = np.ones(scene.chain.granules - 1)
    return deck(scene, Layout(0.05, 2, pair_style), KnownAnswer(ones, 1e-3 * ones))


@pytest.mark.parametrize("pair_style", PAIR_STYLES)
@pytest.mark.parametrize(
    "name", ["demo", *(pytest.param(k, marks=pytest.mark.slow) for k in scenes.NAMES[::4])]
)
def test_nothing_is_said_of_generated_decks(name: str, pair_style: str) -> None:
    assert lint(generated(scenes.load(name), pair_style)) == []

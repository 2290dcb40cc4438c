"""Integration methods as tables of coefficients.

``in_numpy.step`` takes those for u'' = f(t, u); the last one is for forces that depend on
velocities.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SymplecticNystrom:
    """A symplectic method: kicks b and drifts a alternate, first and last a kick."""

    order: int  # order of convergence where the motion is smooth
    kicks: tuple[float, ...]  # b_1 ... b_{s+1}, summing to 1
    drifts: tuple[float, ...]  # a_1 ... a_s, summing to 1

    @property
    def stages(self) -> int:
        """Number of force evaluations in a step."""
        return len(self.drifts)


@dataclass(frozen=True)
class RungeKuttaNystrom:
    """An explicit, not symplectic method; its first stage is the end of the step before.

    ``last_weight`` is the b of an additional stage at the end of the step; it costs nothing,
    because it is the first stage of the next step.
    """

    order: int  # order of convergence where the motion is smooth
    nodes: tuple[float, ...]  # c_1 ... c_s, the first 0
    position: tuple[tuple[float, ...], ...]  # rows of a: a_21; a_31, a_32; and so on
    position_weights: tuple[float, ...]  # b-bar, s of them
    velocity_weights: tuple[float, ...]  # b, s of them
    last_weight: float = 0.0

    @property
    def stages(self) -> int:
        """Number of force evaluations in a step."""
        return len(self.nodes)


@dataclass(frozen=True)
class EmbeddedRungeKutta:
    """An explicit method for y' = f(t, y) that estimates its own error.

    The error of a step h is e5^2 / sqrt(e5^2 + e3^2 / 100), where e5 and e3 are h times the sums of
    the stages with the weights ``fifth`` and ``third``.
    """

    order: int  # order of convergence where the motion is smooth
    nodes: tuple[float, ...]  # c_1 ... c_s, the first 0
    rows: tuple[tuple[float, ...], ...]  # rows of a: a_21; a_31, a_32; and so on
    weights: tuple[float, ...]  # b, s of them
    fifth: tuple[float, ...]  # estimates an error of order 5
    third: tuple[float, ...]  # estimates an error of order 3

    @property
    def stages(self) -> int:
        """Number of force evaluations in a step."""
        return len(self.nodes)


Stepper = SymplecticNystrom | RungeKuttaNystrom
"""A method of some order that takes one step at a time."""


def _symmetric(free: tuple[float, ...], length: int) -> tuple[float, ...]:
    """Return a palindrome of the given length that starts with ``free`` and sums to 1."""
    if length % 2:
        half = (*free, 1.0 - 2 * sum(free))
        return half + free[::-1]
    half = (*free, 0.5 - sum(free))
    return half + half[::-1]


VELOCITY_VERLET = SymplecticNystrom(2, kicks=(0.5, 0.5), drifts=(1.0,))
"""Velocity Verlet, the scheme of LAMMPS."""

RUNGE_KUTTA_4 = RungeKuttaNystrom(
    4,
    nodes=(0.0, 0.5, 0.5, 1.0),
    position=((0.0,), (0.25, 0.0), (0.0, 0.5, 0.0)),
    position_weights=(1 / 6, 1 / 6, 1 / 6, 0.0),
    velocity_weights=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
)
"""The classical Runge-Kutta method, used in the paper, in its form for u'' = f(t, u)."""

DPRKN_6 = RungeKuttaNystrom(
    6,
    nodes=(0.0, 1 / 10, 3 / 10, 7 / 10, 17 / 25),
    position=(
        (1 / 200,),
        (-1 / 2200, 1 / 22),
        (637 / 6600, -7 / 110, 7 / 33),
        (225437 / 1968750, -30073 / 281250, 65569 / 281250, -9367 / 984375),
    ),
    position_weights=(151 / 2142, 5 / 116, 385 / 1368, 55 / 168, -6250 / 28101),
    velocity_weights=(151 / 2142, 25 / 522, 275 / 684, 275 / 252, -78125 / 112404),
    last_weight=1 / 12,
)
"""Dormand, El-Mikkawy and Prince, IMA J. Numer. Anal. 7 (1987) 235: RKN6(4)6FM."""

SRKN_6B = SymplecticNystrom(
    4,
    kicks=_symmetric((0.0829844064174052, 0.396309801498368, -0.0390563049223486), 7),
    drifts=_symmetric((0.245298957184271, 0.604872665711080), 6),
)
"""Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313: SRKN_6^b, 6 stages, order 4."""

SRKN_11B = SymplecticNystrom(
    6,
    kicks=_symmetric(
        (
            0.0414649985182624,
            0.198128671918067,
            -0.0400061921041533,
            0.0752539843015807,
            -0.0115113874206879,
        ),
        12,
    ),
    drifts=_symmetric(
        (
            0.123229775946271,
            0.290553797799558,
            -0.127049212625417,
            -0.246331761062075,
            0.357208872795928,
        ),
        11,
    ),
)
"""Blanes and Moan, J. Comput. Appl. Math. 142 (2002) 313: SRKN_11^b, 11 stages, order 6."""

DOP853 = EmbeddedRungeKutta(
    8,
    nodes=(
        0.0,
        0.05260015195876773,
        0.0789002279381516,
        0.1183503419072274,
        0.2816496580927726,
        0.3333333333333333,
        0.25,
        0.3076923076923077,
        0.6512820512820513,
        0.6,
        0.8571428571428571,
        1.0,
    ),
    rows=(
        (0.05260015195876773,),
        (0.0197250569845379, 0.0591751709536137),
        (0.02958758547680685, 0.0, 0.08876275643042054),
        (0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792),
        (0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242),
        (0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125),
        (
            0.03709200011850479,
            0.0,
            0.0,
            0.17038392571223998,
            0.10726203044637328,
            -0.015319437748624402,
            0.008273789163814023,
        ),
        (
            0.6241109587160757,
            0.0,
            0.0,
            -3.3608926294469414,
            -0.868219346841726,
            27.59209969944671,
            20.154067550477894,
            -43.48988418106996,
        ),
        (
            0.47766253643826434,
            0.0,
            0.0,
            -2.4881146199716677,
            -0.590290826836843,
            21.230051448181193,
            15.279233632882423,
            -33.28821096898486,
            -0.020331201708508627,
        ),
        (
            -0.9371424300859873,
            0.0,
            0.0,
            5.186372428844064,
            1.0914373489967295,
            -8.149787010746927,
            -18.52006565999696,
            22.739487099350505,
            2.4936055526796523,
            -3.0467644718982196,
        ),
        (
            2.273310147516538,
            0.0,
            0.0,
            -10.53449546673725,
            -2.0008720582248625,
            -17.9589318631188,
            27.94888452941996,
            -2.8589982771350235,
            -8.87285693353063,
            12.360567175794303,
            0.6433927460157636,
        ),
    ),
    weights=(
        0.054293734116568765,
        0.0,
        0.0,
        0.0,
        0.0,
        4.450312892752409,
        1.8915178993145003,
        -5.801203960010585,
        0.3111643669578199,
        -0.1521609496625161,
        0.20136540080403034,
        0.04471061572777259,
    ),
    fifth=(
        0.01312004499419488,
        0.0,
        0.0,
        0.0,
        0.0,
        -1.2251564463762044,
        -0.4957589496572502,
        1.6643771824549864,
        -0.35032884874997366,
        0.3341791187130175,
        0.08192320648511571,
        -0.022355307863886294,
    ),
    third=(
        -0.18980075407240762,
        0.0,
        0.0,
        0.0,
        0.0,
        4.450312892752409,
        1.8915178993145003,
        -5.801203960010585,
        -0.4226823213237919,
        -0.1521609496625161,
        0.20136540080403034,
        0.02265179219836082,
    ),
)
"""Dormand and Prince, as in Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I
(1993), section II.5: DOP853, with its two estimates of the error."""

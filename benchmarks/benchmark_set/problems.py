"""The problems in decimal strings: a driveline, how long it is followed, what it tests, its equation in words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction

from mpmath import mp
from tests.literature.paper_cases import paper_case
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Ramp, Stage, Torque
from tests.oracles.equilibrium_mp import equilibrium

from benchmarks.benchmark_set.impact_orbit import impact_orbit


@dataclass(frozen=True)
class Problem:
    """A driveline with its start, followed over ``samples`` samples, ``per_cycle`` in a common period.

    ``tests`` says what solvers get wrong here, ``equation`` is Markdown. ``statistics``: periods that a long run takes for
    averages (discarded, in all), none where the whole motion can be predicted.
    """

    name: str
    title: str
    tests: str
    equation: str
    driveline: Driveline
    samples: int
    per_cycle: int
    statistics: tuple[int, int] | None = None


def decimals(number: Fraction, digits: int = 24) -> str:
    """A fraction as a decimal string of so many significant digits."""
    with mp.workdps(60):
        return mp.nstr(mp.mpf(number.numerator) / number.denominator, digits, strip_zeros=True)


def at_rest(driveline: Driveline) -> Driveline:
    """Start it from its static equilibrium, rounded to 24 digits."""
    angles = tuple(decimals(x) for x in equilibrium(driveline))
    return driveline.start(angles, ("0",) * len(angles))


def free_flight() -> Problem:
    """One body between two elastic stops."""
    stops = Coupling("stops", ("body", "ground"), "4", "0", "0.5")
    return Problem(
        "free-flight",
        "Free flight between two elastic stops",
        "Long-time drift. Nothing damps, so every crossing has a closed form and any loss or gain of energy is the solver's own.",
        """\
    x'' + 4 dz(x, 0.5) = 0,   x(0) = 1.25, x'(0) = 0;   dz(x, b) = x - b, 0, x + b

With w = 2, b = 0.5 and the amplitude A = 1.25 the period is T = 2 pi/w + 4 b/(w (A - b)) = pi + 4/3. The body leaves
the upper stop at pi/(2 w), is at the lower one 2 b/(w (A - b)) = 2/3 later, leaves that after pi/w, and so on for ever.""",
        Driveline("free flight", (Body("body", "1"),), (stops,), speed="1").start(("1.25",), ("0",)),
        160,
        8,
    )


def period_1_orbit() -> Problem:
    """One mass between two stops, driven, on a periodic motion that is known in closed form."""
    return Problem(
        "impact-orbit",
        "Driven impacts on both stops: a periodic motion in closed form",
        "Impacts at the same phase for ever. The start lies exactly on a corner; a solver that asks for a change of sign "
        "there takes the wrong region. Errors at impacts do not die out faster than the motion damps them.",
        """\
    x'' + 25 dz(x, 1) + c(x) x' = P sin t + Q cos t,   c = 2 where |x| > 1, otherwise 0

The motion is symmetric, x(t + pi) = -x(t): in contact over 0 < t < 0.7, in flight until pi. In contact x(t) is linear in
v = x'(0), P and Q, and so is the flight that follows; x(0.7) = 1, x(pi) = -1 and x'(pi) = -v are three linear equations
for v, P and Q. Their solution to 40 digits is in `problem.json`.""",
        impact_orbit(),
        316,
        16,
    )


def shaft_lash() -> Problem:
    """Two undamped inertias with lash, a step of torque."""
    lash = Coupling("driveshaft", ("engine", "vehicle"), "1e4", "0", "0.03")
    bodies = (Body("engine", "43.2"), Body("vehicle", "140"))
    return Problem(
        "shaft-lash-step",
        "Lash of an undamped shaft under a step of torque",
        "A rigid motion without bound: the angles grow to 400 rad beside a lash of 0.03 rad, and the matrix of free flight has a "
        "double eigenvalue zero that is defective. Solvers on absolute angles lose four digits; solvers by eigenvectors fail.",
        """\
    43.2 a'' = 600 - F,   140 b'' = F,   F = 1e4 dz(a - b, 0.03);   at rest in the middle of the lash

Numbers after A. Lagerberg (Chalmers, 2004). d = a - b obeys d'' = 600/43.2 - F (1/43.2 + 1/140), a potential without
damping: it returns to the middle with no speed and starts again.""",
        Driveline("lash", bodies, (lash,), (), (Torque("engine", "600"),), "2").start(("0", "0"), ("0", "0")),
        160,
        32,
    )


def tip_in() -> Problem:
    """An electric axle from coast to drive."""
    bodies = (
        Body("rotor", "0.03"),
        Body("pinion", "4e-4"),
        Body("intermediate", "3e-3"),
        Body("differential", "0.05"),
        Body("vehicle", "164"),
    )
    couplings = (
        Coupling("rotor_spline", ("rotor", "pinion"), "2e4", "1", "0.0017"),
        Coupling("half_shafts", ("differential", "vehicle"), "1.2e4", "60"),
    )
    meshes = (
        Mesh("first_stage", ("pinion", "intermediate"), ("0.025", "0.075"), "3e8", "2500", "8e-5"),
        Mesh("final_drive", ("intermediate", "differential"), ("0.032", "0.099"), "4e8", "3000", "1.2e-4"),
    )
    torques = (Torque("rotor", "-20", (), (Ramp("0.02", "0.05", "80"),)), Torque("vehicle", "185.625"))
    before = Driveline("tip-in", bodies, couplings, meshes, (Torque("rotor", "-20"), torques[1]), "100")
    return Problem(
        "tip-in",
        "Tip-in of an electric axle, -20 to 80 N m within 50 ms",
        "A kink of the input at 0.02 s and 0.07 s that no state shows; three gaps in a row are crossed once each and closed with "
        "bounces. Solvers step over the kinks, or give the three gaps one event.",
        "Rotor, pinion, intermediate shaft, differential, vehicle; spline with play, two meshes with backlash, half shafts. "
        "At rest on the coast flanks until the ramp begins.",
        replace(at_rest(before), torques=torques),
        192,
        48,
    )


def rattling_pair() -> Problem:
    """A loose gear that hammers."""
    bodies = (Body("pinion", "0.01", "0.01"), Body("wheel", "1.5e-3", "1e-3"))
    mesh = Mesh("gear", ("pinion", "wheel"), ("0.05", "0.05"), "3e8", "1200", "1e-4")
    torques = (Torque("pinion", "0.5", (Harmonic("1", "20"), Harmonic("2", "8"))), Torque("wheel", "-0.5"))
    line = Driveline("rattling pair", bodies, (), (mesh,), torques, "200")
    return Problem(
        "rattling-pair",
        "A loose gear that rattles against both flanks",
        "Contacts of 0.1 ms between flights of ms: the step has to fall by a hundred at an instant that only the deflection, a "
        "difference of two angles, shows.",
        """\
    0.01 p'' + 0.01 p' = 0.5 + 20 sin 200 t + 8 sin 400 t - 0.05 F,   0.0015 w'' + 0.001 w' = -0.5 + 0.05 F
    F = 3e8 dz(d, 5e-5) + 1200 d' (|d| > 5e-5, otherwise 0),   d = 0.05 (p - w)""",
        at_rest(line),
        192,
        48,
    )


SIMPLE = (free_flight, period_1_orbit, shaft_lash, tip_in, rattling_pair)


def _oscillator(
    name: str, load: Torque, speed: str, damping: str = "0.1", start: tuple[str, str] = ("1.1", "0")
) -> Driveline:
    """The backlash oscillator x'' + damping x' + dz(x, 1) = load, damped in the gap as much as in contact."""
    mesh = Coupling("mesh", ("gear", "ground"), "1", damping, "1", "0", "1")
    line = Driveline(name, (Body("gear", "1"),), (mesh,), (), (load,), speed)
    return line.start((start[0],), (start[1],))


def single_sided() -> Problem:
    """The preloaded oscillator with impacts on one flank."""
    load = Torque("gear", "0.1", (Harmonic("1", "0.04"),))
    return Problem(
        "single-sided",
        "A preloaded gear pair that leaves its flank and returns to it",
        "Shallow excursions into the gap close to resonance: a solver that damps a little too much stays in contact.",
        "    x'' + 0.1 x' + dz(x, 1) = 0.1 + 0.04 sin 0.9 t",
        _oscillator("single-sided", load, "0.9", start=("1.3", "0.3")),
        384,
        24,
    )


def double_sided() -> Problem:
    """The preloaded oscillator with impacts on both flanks."""
    load = Torque("gear", "0.1", (Harmonic("1", "0.3"),))
    return Problem(
        "double-sided",
        "A preloaded gear pair that hits both flanks",
        "Impacts on alternate flanks with a mean load: the sequence of regions must be right as well as their number.",
        "    x'' + 0.1 x' + dz(x, 1) = 0.1 + 0.3 sin 0.6 t",
        _oscillator("double-sided", load, "0.6"),
        384,
        24,
    )


def clutch_stages() -> Problem:
    """A clutch damper of three stages, other on the coast side."""
    drive = (Stage("30", "0.02", "0.07"), Stage("600", "0.1", "0.21"), Stage("5000", "0.3"))
    coast = (Stage("30", "0.02", "0.05"), Stage("450", "0.1", "0.16"), Stage("5000", "0.3"))
    damper = Coupling("damper", ("flywheel", "gearbox"), stages=drive, coast_stages=coast, preload="0.5")
    bodies = (Body("flywheel", "0.14", "0.01"), Body("gearbox", "0.02", "0.05"))
    torques = (Torque("flywheel", "40", (Harmonic("2", "300", "0.3"), Harmonic("4", "80"))), Torque("gearbox", "-40"))
    return Problem(
        "clutch-stages",
        "A clutch damper of three stages with a preload, asymmetric",
        "No free gap: stiffness and damping jump by twenty at a corner while the torque is continuous. Step control by the error "
        "estimate sees little, and loses its order.",
        "Flywheel and gearbox; drive stages 30, 600, 5000 N m/rad up to 0.07 and 0.21 rad, coast stages 30, 450, 5000 N m/rad "
        "up to 0.05 and 0.16 rad, 0.5 N m at zero deflection.",
        at_rest(Driveline("clutch stages", bodies, (damper,), (), torques, "100")),
        192,
        24,
    )


def paper(number: int, loaded: bool) -> Problem:
    """A case of the 1995 paper."""
    load = "loaded" if loaded else "rattling"
    clutch = {1: "moderately", 2: "moderately", 3: "strongly"}[number]
    gaps = "two gaps (clutch, mesh)" if number == 1 else "three gaps (clutch, spline, mesh) and transmission error"
    what = (
        "The teeth stay together but for the start: few crossings, long accuracy."
        if loaded
        else "The loose gear rattles; errors grow, so that what is right can be said to a horizon only."
    )
    return Problem(
        f"transmission-{number}-{load}",
        f"Manual transmission of four inertias, case {number}, {load}",
        f"The field's own model with {gaps}, a {clutch} nonlinear clutch and stiffnesses 480 times apart. {what}",
        "Case of Padmanabhan, Barlow, Rook and Singh (J. Mech. Des. 117, 1995): flywheel, hub, input gear, output gear; five "
        "harmonics of torque. Loads are ours, the paper prints none.",
        at_rest(paper_case(number, loaded)),
        240 if loaded else 180,
        60,
        None if loaded else (100, 1100),
    )


def six_inertias() -> Problem:
    """A gearbox with two loose gears, a spline with play and a staged clutch."""
    drive = (Stage("28", "0.02", "0.07"), Stage("340", "0.1", "0.24"), Stage("2300", "0.2"))
    bodies = (
        Body("flywheel", "0.15", "0.01"),
        Body("hub", "6e-4"),
        Body("input_shaft", "2.4e-3", "1e-3", "0.4"),
        Body("second_gear", "1.2e-3", "2e-4", "0.1"),
        Body("fifth_gear", "3.5e-4", "1e-4", "0.07"),
        Body("output_shaft", "8e-3", "2e-3"),
    )
    couplings = (
        Coupling("damper", ("flywheel", "hub"), stages=drive),
        Coupling("spline", ("hub", "input_shaft"), "1e4", "0.1", "0.0035"),
        Coupling("synchroniser", ("second_gear", "output_shaft"), "5e3", "0.2", "0.02"),
    )
    meshes = (
        Mesh(
            "second_mesh",
            ("input_shaft", "second_gear"),
            ("0.0225", "0.045"),
            "3.2e8",
            "800",
            "1.2e-4",
            (Harmonic("21", "6e-6"),),
        ),
        Mesh(
            "fifth_mesh",
            ("input_shaft", "fifth_gear"),
            ("0.036", "0.0315"),
            "3.2e8",
            "800",
            "1e-4",
            (Harmonic("40", "4e-6", "1"),),
        ),
    )
    torques = (Torque("flywheel", "0.53", (Harmonic("2", "50"), Harmonic("4", "18", "0.6"))),)
    return Problem(
        "gearbox-6",
        "A gearbox of six inertias with five gaps",
        "Five elements with corners in one system: most combinations of regions are never visited, many are for microseconds. "
        "Several gaps are crossed within one step.",
        "Flywheel, three-stage damper, hub, spline with play, input shaft, two loose gears behind their backlash, one of them with "
        "a synchroniser that has play to the output shaft; transmission errors of orders 21 and 40.",
        _slack(Driveline("gearbox", bodies, couplings, meshes, torques, "80")),
        96,
        96,
    )


def _slack(line: Driveline) -> Driveline:
    """Start it at rest, all angles zero: every gap in its middle."""
    return line.start(("0",) * len(line.bodies), ("0",) * len(line.bodies))


def sixteen_inertias() -> Problem:
    """A whole driveline from crank to wheels."""
    inertias = ("0.012", "0.013", "0.0125", "0.0135", "0.14", "5e-4", "2.5e-3", "1.9e-3", "1.05e-3", "5.6e-4", "3.5e-4")
    inertias += ("2.2e-4", "4e-3", "0.05", "0.9", "1.1")
    names = (
        "crank1",
        "crank2",
        "crank3",
        "crank4",
        "flywheel",
        "hub",
        "input_shaft",
        "gear1",
        "gear2",
        "gear3",
        "gear4",
    )
    names += ("gear5", "output_shaft", "differential", "left_wheel", "right_wheel")
    drags = {
        "input_shaft": "5e-3",
        "gear1": "2e-3",
        "gear2": "1.5e-3",
        "gear3": "1e-3",
        "left_wheel": "0.5",
        "right_wheel": "0.4",
    }
    bodies = tuple(Body(n, j, drags.get(n, "1e-4")) for n, j in zip(names, inertias, strict=True))
    stages = (Stage("60", "0.05", "0.07"), Stage("460", "0.2", "0.2"), Stage("1500", "0.3"))
    couplings = (
        Coupling("journal12", ("crank1", "crank2"), "4e5", "4"),
        Coupling("journal23", ("crank2", "crank3"), "4.2e5", "4"),
        Coupling("journal34", ("crank3", "crank4"), "4.1e5", "4"),
        Coupling("journal45", ("crank4", "flywheel"), "5e5", "5"),
        Coupling("damper", ("flywheel", "hub"), stages=stages),
        Coupling("spline", ("hub", "input_shaft"), "1e4", "0.1", "0.0035"),
        Coupling("dog4", ("gear4", "output_shaft"), "2e4", "0.5", "0.03"),
        Coupling("left_shaft", ("differential", "left_wheel"), "6e3", "5"),
        Coupling("right_shaft", ("differential", "right_wheel"), "5e3", "5"),
    )
    radii = (
        ("0.0147", "0.053"),
        ("0.0222", "0.0455"),
        ("0.0287", "0.039"),
        ("0.03335", "0.03435"),
        ("0.0372", "0.0305"),
    )
    gaps = ("1.4e-4", "1.2e-4", "1e-4", "9e-5", "7e-5")
    meshes = tuple(
        Mesh(f"mesh{i}", ("input_shaft", f"gear{i}"), r, "1e8", "500", gap)
        for i, (r, gap) in enumerate(zip(radii, gaps, strict=True), 1)
    )
    meshes += (Mesh("final_drive", ("output_shaft", "differential"), ("0.03", "0.1"), "2e8", "2000", "1.6e-4"),)
    torques = tuple(
        Torque(f"crank{i}", "6", (Harmonic("2", amplitude, phase), Harmonic("4", "9", phase)))
        for i, amplitude, phase in zip(
            range(1, 5), ("22", "23", "21", "22.5"), ("0.1", "0.2", "0.3", "0.4"), strict=True
        )
    )
    return Problem(
        "driveline-16",
        "A driveline of sixteen inertias with eight gaps",
        "Size and stiffness together: eight elements with corners, frequencies from 0 to 40000 rad/s, a rigid motion that drifts.",
        "Four cranks, flywheel, three-stage damper, hub, spline, input shaft, five gears of which four are loose and the fourth is "
        "engaged by a dog clutch with play, output shaft, final drive with backlash, differential, two wheels.",
        _slack(Driveline("driveline of sixteen", bodies, couplings, meshes, torques, "90")),
        48,
        48,
    )


def transmission_error() -> Problem:
    """A loaded gear pair excited by its own error."""
    bodies = (Body("pinion", "0.01", "0.02"), Body("wheel", "4e-3", "0.02"))
    error = (Harmonic("20", "8e-6"), Harmonic("40", "2e-6", "0.7"))
    mesh = Mesh("gear", ("pinion", "wheel"), ("0.05", "0.05"), "1.5e8", "600", "1e-4", error)
    torques = (Torque("pinion", "20"), Torque("wheel", "-20"))
    return Problem(
        "transmission-error-20",
        "A loaded gear pair excited by its transmission error at order 20",
        "The excitation is inside the deflection, d = R (p - w) - e(t), so corners move in terms of the states: an event function of "
        "states alone is wrong by the whole error, and the contact force has its rate.",
        "    d = 0.05 (p - w) - 8e-6 sin 20 W t - 2e-6 sin(40 W t + 0.7),   W = 570",
        at_rest(Driveline("transmission error", bodies, (), (mesh,), torques, "570")),
        288,
        14,
    )


def grazing() -> Problem:
    """Two bodies thrown at a stop: one touches by a millionth, one misses it by as much."""
    stops = tuple(Coupling(f"stops_{n}", (n, "ground"), "100", "0", "1") for n in ("touching", "missing"))
    torques = (Torque("touching", "-0.5"), Torque("missing", "-0.5"))
    line = Driveline("grazing", (Body("touching", "1"), Body("missing", "1")), stops, (), torques, "1")
    return Problem(
        "grazing",
        "Grazing: one body touches its stop by 1e-6, another misses it by 1e-6",
        "Touch-and-go inside one step, a hundred times: enters and leaves a region between two points that both lie outside it. "
        "A drift of energy of 1e-6 turns touches into misses and misses into touches.",
        """\
    x'' + 100 dz(x, 1) = -0.5  (twice),   x(0) = 0,   x'(0)^2 = 1 + 1e-6 and 1 - 1e-6

Without the upper stop the bodies rise to 1 + 1e-6 and 1 - 1e-6. Nothing damps: the lower stop throws them up as high again.""",
        line.start(("0", "0"), ("1.000000499999875", "0.999999499999875")),
        160,
        8,
    )


def rest_in_contact() -> Problem:
    """A body hits a row of bodies that rest exactly on their corners."""
    bodies = (Body("hammer", "1"), Body("anvil", "2", "0.3"), Body("wall_side", "3", "0.3"))
    couplings = (
        Coupling("first_gap", ("hammer", "anvil"), "400", "20", "0.5"),
        Coupling("second_gap", ("anvil", "wall_side"), "500", "30", "0.25"),
        Coupling("spring", ("wall_side", "ground"), "50", "8"),
    )
    torques = (Torque("hammer", "1"),)
    line = Driveline("rest in contact", bodies, couplings, (), torques, "1")
    return Problem(
        "rest-in-contact",
        "A row of bodies that rest exactly on their corners is hit, and comes to rest in contact",
        "Exactly on a corner at rest no derivative decides: the second gap must stay quiet until the hammer comes, then open at the "
        "very instant of the first contact (two events at one time). At the end all is pressed together for ever: "
        "no event is right, chatter is wrong.",
        """\
    h'' = 1 - F1,   2 a'' + 0.3 a' = F1 - F2,   3 w'' + 0.3 w' = F2 - 50 w - 8 w'
    F1 = 400 dz(h - a, 0.5) + 20 (h' - a') in contact,   F2 = 500 dz(a - w, 0.25) + 30 (a' - w') in contact
    h(0) = 0, a(0) = 0.25, w(0) = 0: the second gap is on its corner, nothing moves but the hammer""",
        line.start(("0", "0.25", "0"), ("0", "0", "0")),
        160,
        16,
    )


def stiff_gap() -> Problem:
    """Stages a million apart."""
    gap = Coupling("gap", ("body", "ground"), "1e6", "20", "1", "1e-6", "0.001")
    line = Driveline(
        "stiff gap", (Body("body", "1"),), (gap,), (), (Torque("body", "0.2", (Harmonic("1", "1.5"),)),), "0.9"
    )
    return Problem(
        "stiff-gap",
        "Contact a million times as stiff as the gap",
        "Contacts of 3 ms in a motion of 7 s: the step must fall by a thousand and rise again; implicit methods that do not see the "
        "corner average over the contact.",
        "    x'' + f(x) + c(x) x' = 0.2 + 1.5 sin 0.9 t;   slope 1 and c = 0.02 for |x| < 1, slope 1e6 and c = 20 beyond",
        line.start(("0",), ("1",)),
        192,
        24,
    )


def chaos() -> Problem:
    """The gear rattle oscillator in a chaotic motion."""
    flanks = Coupling("flanks", ("gear", "ground"), "200", "0", "0.6")
    torque = Torque("gear", "7.54", (Harmonic("1", "30", "-1.666"),))
    line = Driveline("chaotic rattle", (Body("gear", "1", "0.6"),), (flanks,), (), (torque,), "6.25")
    return Problem(
        "chaotic-rattle",
        "A gear that rattles chaotically",
        "Errors grow exponentially. Beyond the horizon of a solver only statistics can be compared: rms values and the rate of impacts.",
        """\
    x'' + 0.6 x' + 200 dz(x, 0.6) = 7.54 + 30 sin(6.25 t - 1.666)

After Mason, Piiroinen, Wilson and Homer (Int. J. Bifurcation and Chaos 19, 2009), other numbers.""",
        line.start(("0",), ("0",)),
        800,
        16,
        (100, 2100),
    )


def long_flights() -> Problem:
    """Wide gap, little damping, short contacts."""
    walls = Coupling("walls", ("body", "ground"), "1e4", "0.5", "1000")
    line = Driveline("long flights", (Body("body", "1"),), (walls,), (), (), "0.01")
    return Problem(
        "long-flights",
        "Long free flights between short contacts, hardly damped",
        "In flight the solution is a straight line and every error estimate is zero: steps grow until one jumps over the wall, the "
        "contact and the way back. 30 ms of contact, 200 s of flight.",
        "    x'' + 1e4 dz(x, 1000) + 0.5 x' (|x| > 1000) = 0,   x(0) = 0, x'(0) = 10",
        line.start(("0",), ("10",)),
        240,
        24,
    )


PAPER = tuple((lambda n=n, loaded=loaded: paper(n, loaded)) for loaded in (True, False) for n in (1, 2, 3))
PROBLEMS = (
    *SIMPLE,
    single_sided,
    double_sided,
    clutch_stages,
    *PAPER,
    six_inertias,
    sixteen_inertias,
    transmission_error,
    grazing,
    rest_in_contact,
    stiff_gap,
    chaos,
    long_flights,
)

"""Record what the installed build of exactcreep does, as one flat mapping of fields to values.

``python -P tests/recorder.py OUT.json [--quick] [--only GROUP]`` runs scenes, hard cases,
checkpoints, commands and refusals in the current directory, through public names and the command
line alone, so that builds of different ages can be compared; `tests/guard.py` does that.

A field is a path such as ``scenes/chain-jumps/0/exact/recorded/x_G``. Its value is None, a truth
value, a whole number, a string, or a list of them; a float stands as its hexadecimal digits, a
rational or a number of many digits as the ratio or the ball that it is: equal values, equal bits.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import inspect
import io
import itertools
import json
import math
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from PIL import Image

import exactcreep
from exactcreep import (
    Chain,
    Creep,
    Cycles,
    GaussianSteps,
    State,
    creep,
    disorder,
    iterate,
    laws,
    load_scene,
    physical,
    rearrange,
    resume,
)
from exactcreep import Path as ThetaPath
from exactcreep.cli import main

Field = tuple[str, Any]

DATA = Path(__file__).parent / "data"
RECORDS = ("x_G", "x", "tension", "slips", "events")
SOLVERS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("exact", {}),
    ("reference", {}),
    ("mpmath", {"digits": 30}),
    ("certified", {"digits": 30}),
    ("verlet", {}),
    ("verlet", {"locate": True}),
    ("sliding", {}),
)
"""Every solver, with the options under which it is recorded."""
SLOW = {"mpmath", "certified"}
MASKED = (
    (re.compile(r"\b\d[\d.e+-]* ?(us|ms|s|min|h)\b"), "<time>", "a measured time"),
    (re.compile(r"compiling the kernel, once; the next start finds it ready\n"), "", "said only"
     " where no compiled code was found"),
    (re.compile(r"reads version \d+"), "reads version <n>", "a checkpoint's, which may rise"),
)  # fmt: skip
"""What is cut out of printed text before it is recorded, and why."""


# --- values ----------------------------------------------------------------------------------


def bits(value: Any) -> Any:
    """Return a value as JSON that is equal for equal bits alone."""
    if isinstance(value, Enum):
        return value.value
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, np.generic):
        return bits(value.item())
    if isinstance(value, float):
        return value.hex()
    if isinstance(value, Fraction):
        return f"{value.numerator}/{value.denominator}"
    if isinstance(value, bytes):
        return value.decode("utf-8", "backslashreplace")
    if isinstance(value, (tuple, list)):
        return "(" + ", ".join(str(bits(part)) for part in value) + ")"
    if hasattr(value, "_mpf_"):
        sign, mantissa, exponent, _ = value._mpf_
        return f"{'-' * sign}{int(mantissa)}*2^{exponent}"
    if hasattr(value, "mid") and hasattr(value, "rad"):
        ends = [part.man_exp() for part in (value.mid(), value.rad())]
        return " +- ".join(f"{int(mantissa)}*2^{int(power)}" for mantissa, power in ends)
    return f"{type(value).__name__} {value}"


def fields(name: str, value: Any) -> Iterator[Field]:
    """Yield the flat fields of a value: mappings and nested lists by their keys and indices."""
    if isinstance(value, Mapping):
        if not value:
            yield name, "{}"
        for key, part in value.items():
            yield from fields(f"{name}/{key}", part)
    elif isinstance(value, np.ndarray):
        yield f"{name}:type", f"{value.dtype.kind}{value.dtype.itemsize} {value.shape}"
        yield name, [bits(part) for part in value.ravel().tolist()]
    elif isinstance(value, (list, tuple)):
        if any(isinstance(part, (Mapping, list, np.ndarray)) for part in value):
            for number, part in enumerate(value):
                yield from fields(f"{name}/{number}", part)
        else:
            yield name, [bits(part) for part in value]
    else:
        yield name, bits(value)


def attempt(name: str, call: Callable[[], Any]) -> Iterator[Field]:
    """Yield the fields of what a call returns, or what it raises: its type and its sentence."""
    try:
        found = list(fields(name, call()))
    except Exception as error:
        found = [(f"{name}/raised", f"{type(error).__name__}: {error}")]
    yield from found


def of_state(state: State) -> dict[str, Any]:
    """Return a state by names."""
    names = ("tensions", "displacements", "coefficients", "draws", "theta")
    return {name: getattr(state, name) for name in names}


def of_events(events: Sequence[Any]) -> dict[str, Any]:
    """Return events column by column."""
    return {
        "itinerary": [str(event.signature) for event in events],
        "time": [event.time for event in events],
        "residual": [event.residual for event in events],
    }


def of_rearrangement(found: Any) -> dict[str, Any]:
    """Return a rearrangement by names, its closed form at five times."""
    names = ("outcome", "evidence", "velocities", "undecided", "draws_below_mu_d", "solver",
             "report", "reason", "error", "doubt", "theta", "duration")  # fmt: skip
    out = {name: getattr(found, name) for name in names}
    out |= {"events": of_events(found.events), "state": of_state(found.state)}
    out |= {"initial": of_state(found.initial), "pieces": len(found.sol.pieces)}
    if found.events:
        ends = found.sol.t_min, found.sol.t_max
        out["sol"] = {
            part: found.sol(ends[0] + (ends[1] - ends[0]) * part / 4)._asdict() for part in range(5)
        }
    return out


def of_creep(found: Creep) -> dict[str, Any]:
    """Return a result by names; the summary, the state at the end, and all that was recorded."""
    names = ("velocity", "velocity_error", "velocity_enclosure", "warnings", "x_G", "reason")
    out = {name: getattr(found, name) for name in names}
    return out | {
        "summary": found.summary(),
        "state": of_state(found.state),
        "recorded": dict(found.recorded),
    }


# --- groups of fields ------------------------------------------------------------------------


def public(quick: bool) -> Iterator[Field]:
    """Yield the public names, and of each that can be called its parameters and their defaults."""
    for name in exactcreep.__all__:
        value = getattr(exactcreep, name)
        if name == "__version__" or inspect.ismodule(value):
            yield f"public/{name}", type(value).__name__
        elif isinstance(value, type) and issubclass(value, (Enum, Exception)):
            yield f"public/{name}", value.__mro__[1].__name__
        else:
            told = inspect.signature(value).parameters.values()
            yield f"public/{name}", [str(part.replace(annotation=part.empty)) for part in told]
    for name in ("Outcome", "Evidence", "EventKind"):
        yield f"public/{name}/words", [part.value for part in getattr(exactcreep, name)]


def scenes(quick: bool) -> Iterator[Field]:
    """Yield runs of members of every built-in scene, shortened, under every solver."""
    for name in scene_names():
        scene = load_scene(name)
        length = "cycles" if "cycles" in scene.tables["drive"] else "steps"
        settings = scene.settings()
        some = {len(settings) * 2 // 3} if quick else {0, len(settings) // 2, len(settings) - 1}
        for number, (solver, options) in itertools.product(sorted(some), SOLVERS):
            targets = 2 if solver in SLOW else 4 if solver == "reference" else 10
            short = {f"drive.{length}": targets} if length in scene.tables["drive"] else {}
            given = scene.with_settings(short)  # a record has the length that it has
            made = given.experiment(settings[number])
            most = 400 if quick else 1500
            # a hundred sliders come to a million events in ten half-cycles
            events = most // 8 if solver in SLOW else most if solver == "reference" else 40 * most
            told = options | ({} if solver == "sliding" else {"max_events": events})
            whole = RECORDS[:4] if solver == "sliding" else RECORDS
            for record in (whole,):
                yield from attempt(
                    f"scenes/{name}/{number}/{labelled(solver, options)}/{len(record)}",
                    lambda made=made, solver=solver, told=told, record=record: of_creep(
                        creep(made.chain, made.drive, seed=made.seed, start=made.start,
                              solver=solver, record=record, **told)
                    ),
                )  # fmt: skip


def scene_names() -> list[str]:
    """Return the names of the built-in scenes, as the command line lists them."""
    told = json.loads(spoken("scenes", "--json")["out"])
    return [scene["name"] for scene in told["scenes"]]


def labelled(solver: str, options: Mapping[str, Any]) -> str:
    """Return a solver with its options, as it stands in a field."""
    return "-".join([solver, *(name for name in options if name != "digits")])


def hard(quick: bool) -> Iterator[Field]:
    """Yield `rearrange` and `iterate` on the hard cases, under every solver that has inertia."""
    cases = json.loads((DATA / "hard_cases.json").read_text("utf-8"))
    solvers = [pair for pair in SOLVERS if pair[0] != "sliding"] + [("exact", {"escalate": True})]
    for case in cases[:: 4 if quick else 1]:
        chain = Chain(**case["chain"])
        state = State.prepared(chain, case["start"], seed=case["seed"])
        about = {"direction": case["direction"], "seed": case["seed"]}
        for solver, options in solvers:
            name = f"{case['label']}/{labelled(solver, options)}"
            most = 40 if quick or solver in SLOW else 300
            call = about | {"solver": solver, **options}
            yield from attempt(
                f"hard/{name}",
                lambda chain=chain, state=state, call=call, most=most: of_rearrangement(
                    rearrange(chain, state, max_events=most, **call)
                ),
            )
            yield from attempt(
                f"iterate/{name}",
                lambda chain=chain, state=state, call=call, most=most: of_events(
                    list(itertools.islice(iterate(chain, state, **call), most))
                ),
            )


def whole(quick: bool) -> Iterator[Field]:
    """Yield rearrangements of burned-in and of random chains of up to thirty sliders."""
    with np.load(DATA / "whole_rearrangements.npz") as file:
        data = dict(file)
    sliders = np.concatenate([[0], np.cumsum(data["n"])])
    for k in range(0, len(data["n"]), 12 if quick else 2):
        n, seed = int(data["n"][k]), int(data["seed"][k])
        mu_d, mu_s, sigma_mu = data["friction"][k].tolist()
        chain = Chain(n, 1000, mu_d, mu_s, sigma_mu, tan_alpha=str(data["tan_alpha"][k]))
        draws = data["draws"][sliders[k] : sliders[k + 1]].astype(np.int64)
        drawn = [disorder.static_coefficient(chain, seed, i + 1, int(d) - 1)
                 for i, d in enumerate(draws)]  # fmt: skip
        tensions = data["tensions"][sliders[k] - k : sliders[k + 1] - k - 1]
        state = State(tensions, np.zeros(n), np.array(drawn, dtype=float), draws, 0.0)
        for solver in ("exact", "reference", "verlet") if k % 3 == 0 else ("exact",):
            yield from attempt(
                f"whole/{data['label'][k]}/{solver}",
                lambda chain=chain, state=state, solver=solver, k=k, seed=seed: of_rearrangement(
                    rearrange(chain, state, direction=int(data["direction"][k]), seed=seed,
                              solver=solver)
                ),
            )  # fmt: skip


def resumed(quick: bool) -> Iterator[Field]:
    """Yield runs that stopped at a limit and went on from their checkpoint, and saved results."""
    drives = (Cycles("0.004", 6), GaussianSteps("0.004", 12), ThetaPath(["0.002", "-0.001"]))
    for drive, (solver, options) in itertools.product(drives, SOLVERS):
        if quick and solver in SLOW and not isinstance(drive, ThetaPath):
            continue
        name = f"{type(drive).__name__}-{labelled(solver, options)}"
        record = RECORDS[:4] if solver == "sliding" else RECORDS
        call = {"seed": 5, "solver": solver, "record": record} | options

        def stopped(drive: Any = drive, call: Any = call, name: str = name) -> dict[str, Any]:
            early = creep(CHAIN, drive, max_events=60, checkpoint=f"{name}.ckpt", **call)
            late = resume(f"{name}.ckpt", max_events=400)
            late.save(f"{name}.nc", force=True)
            back = Creep.load(f"{name}.nc")
            return {"early": of_creep(early), "late": of_creep(late), "saved": of_creep(back)}

        yield from attempt(f"resumed/{name}", stopped)
        yield from of_file(f"resumed/{name}.nc", Path(f"{name}.nc"))


# --- the command line ------------------------------------------------------------------------


def spoken(*words: str) -> dict[str, Any]:
    """Run a command in this process; return its exit status and what it printed."""
    out, err = io.StringIO(), io.StringIO()
    before = sys.argv
    sys.argv = ["exactcreep", *words]
    code: Any = 0
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as left:
        code = left.code
    finally:
        sys.argv = before
    told = [line for line in masked(err.getvalue()).splitlines() if line.startswith("exactcreep:")]
    return {"status": code, "out": out.getvalue(), "err": told}  # progress follows the clock


def masked(text: str) -> str:
    """Return printed text without what `MASKED` names and without the present directory."""
    for pattern, mask, _ in MASKED:
        text = pattern.sub(mask, text)
    text = text.replace(str(Path.cwd()), "<here>")
    # a measured time makes the column of a table wider or narrower
    return "".join(" ".join(line.split()) + "\n" for line in text.splitlines())


def lines(name: str) -> list[str]:
    """Return the lines of a list in `tests/data/guard`, its comments included."""
    return (DATA / "guard" / name).read_text("utf-8").splitlines()


def commands(quick: bool) -> Iterator[Field]:
    """Yield what every command prints and writes, with its exit status."""
    for name, content in FILES.items():
        Path(name).write_bytes(content)
    listed = lines("commands.txt")
    for line in listed[: listed.index("# slow") if quick else None]:
        if line.startswith("#"):
            continue
        before = {path: path.stat().st_mtime_ns for path in Path().rglob("*")}
        yield from of_command(line)
        for path in sorted(Path().rglob("*")):
            if path.is_file() and before.get(path) != path.stat().st_mtime_ns:
                yield from of_file(f"commands/{line}/{path}", path)


def of_command(line: str, group: str = "commands") -> Iterator[Field]:
    """Yield the exit status and the output of a command; its JSON field by field."""
    name, words = f"{group}/{line}", [word for word in line.split(" ") if word != '""']
    told = spoken(*words)
    out = told.pop("out")
    yield from fields(name, told)
    if "--json" in words and out:
        parsed = json.loads(out, parse_float=str, parse_constant=str)
        yield from fields(f"{name}/json", parsed)
    else:
        yield f"{name}/out", masked(out).splitlines()


def of_file(name: str, path: Path) -> Iterator[Field]:
    """Yield what a written file holds: data by their bits, pictures by a digest of each frame."""
    if not path.is_file():
        return
    if path.suffix == ".nc" and h5py.is_hdf5(path):
        with h5py.File(path) as file:
            parts: list[tuple[str, Any]] = [("", file)]
            file.visititems(lambda key, part: parts.append((key, part)))
            for key, part in parts:
                for attribute, value in part.attrs.items():
                    if not attribute.startswith("_") and attribute not in NETCDF_OWN:
                        yield from fields(f"{name}/{key}.{attribute}", value)
                if isinstance(part, h5py.Dataset):
                    yield from fields(f"{name}/{key}", np.asarray(part[()]))
    elif path.suffix in (".png", ".gif"):
        with Image.open(path) as image:
            for frame in range(getattr(image, "n_frames", 1)):
                image.seek(frame)
                pixels = image.convert("RGBA").tobytes()
                told = f"{image.size} {hashlib.sha256(pixels).hexdigest()}"
                yield f"{name}/frame {frame}", told
    elif path.suffix in (".csv", ".txt"):
        yield name, masked(path.read_text("utf-8")).splitlines()
    else:
        yield name, "written"


NETCDF_OWN = {"DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME"}
"""Attributes by which the file format links its parts; they hold addresses in the file."""


# --- refusals --------------------------------------------------------------------------------

CHAIN = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
PAIR = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
RUN = Cycles("0.001", 1)
LEAD = {"length": 10, "youngs_modulus": 1.6e10, "density": 11340, "section": 0.01, "kappa": 2.9e-5,
        "contacts": 5, "mu_d": 0.5, "mu_s": 0.6, "tan_alpha": 0.3}  # fmt: skip


def rest(**changes: Any) -> State:
    """Return the relaxed chain with some of its fields replaced."""
    return State(**of_state(State.relaxed(CHAIN)) | changes)


FILES = {path.name: path.read_bytes() for path in sorted(DATA.glob("guard/files/*"))}
"""What lies in the directory in which commands and calls are tried."""


def refused(quick: bool) -> Iterator[Field]:
    """Yield the exit status and the sentence of bad command lines and of bad calls."""
    for name, content in FILES.items():
        Path(name).write_bytes(content)
    creep(PAIR, RUN, checkpoint="whole.ckpt")
    whole = Path("whole.ckpt").read_bytes()
    Path("damaged.ckpt").write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    for line in lines("bad_commands.txt")[1:]:
        yield from of_command(line, "refused")
    known = {name: getattr(exactcreep, name) for name in exactcreep.__all__}
    known |= {"CHAIN": CHAIN, "PAIR": PAIR, "RUN": RUN, "LEAD": LEAD, "rest": rest, "math": math,
              "exactcreep": exactcreep}  # fmt: skip
    for line in lines("bad_calls.txt")[1:]:
        try:
            found = f"accepted: {type(eval(line, known)).__name__}"
        except Exception as error:
            found = f"{type(error).__name__} of {getattr(error, 'field', None)}: {error}"
        yield f"refused/{line}", masked(found)
    yield "refused/files", sorted(str(path) for path in Path().iterdir())


def formulas(quick: bool) -> Iterator[Field]:
    """Yield every law at a few points, and what is drawn at random."""
    given = {"n": 6, "l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "amplitude": 0.01,
             "sigma_theta": 0.01, "i": 2}  # fmt: skip
    for law, slope in itertools.product(vars(laws).values(), (0.05, 0.25, 0.4)):
        if hasattr(law, "__wrapped__"):
            names = inspect.signature(law).parameters
            known = {**given, "tan_alpha": slope}
            known = {name: value for name, value in known.items() if name in names}
            exactly = {name: Fraction(str(value)) for name, value in known.items()}
            name = f"formulas/{law.__name__}/{slope}"
            yield from attempt(name, partial(law, **known))
            yield from attempt(f"{name}/exactly", partial(law, **exactly))
    for n, slope in itertools.product((2, 3, 6, 30), ("0", "0.05", "0.25", "0.49")):
        pivots = partial(laws.pivots, n, Fraction(slope), Fraction(1, 2))
        yield from attempt(f"formulas/pivots/{n}/{slope}", pivots)
    for k in range(4):
        yield from attempt(f"formulas/drawn/{k}", lambda k=k: [
            disorder.static_coefficient(CHAIN, 7, 3, k),
            disorder.dilation(GaussianSteps("0.01", 9), 7, k + 1),
        ])  # fmt: skip
    yield from attempt("formulas/physical", lambda: {
        name: value for name, value in vars(physical(**LEAD)).items() if not callable(value)
    })  # fmt: skip


GROUPS: dict[str, Callable[[bool], Iterator[Field]]] = {
    "public": public,
    "refused": refused,
    "formulas": formulas,
    "scenes": scenes,
    "hard": hard,
    "whole": whole,
    "resumed": resumed,
    "commands": commands,
}
"""The groups of fields by name, in the order in which they are recorded."""


def record(groups: Sequence[str], *, quick: bool) -> dict[str, Any]:
    """Return all fields of these groups; files are written to the present directory."""
    found: dict[str, Any] = {}
    for group in groups:
        begin = time.perf_counter()
        for name, value in GROUPS[group](quick):
            assert name not in found, f"two fields are called {name}"
            found[name] = value
        sys.stderr.write(f"  {group}: {time.perf_counter() - begin:.0f} s\n")
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", action="append", choices=GROUPS)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    asked.out.write_text(json.dumps(record(asked.only or list(GROUPS), quick=asked.quick)), "utf-8")

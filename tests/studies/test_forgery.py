"""A forging test of the audit: every number and word of a file is changed, one by one."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from exactcreep import Creep, Cycles, Evidence, InputError, Outcome, creep
from exactcreep.quasistatic.netcdf import netcdf
from exactcreep.studies.audits.audit import audit_file, audit_written
from tests.paper import paper_chain

CANNOT_BE_KNOWN = {
    "version": "of the program that wrote the file",
    "seconds": "of the machine that computed it",
    "twin": "what was asked for: with a twin or without, the run is the same",
    "rearrangement_undecided": "ties that are not in the events",
    "report": "the work that it took; its assumed ties are checked against those counted",
}
"""Attributes that an audit cannot make again, and what they are about."""
MARGINS = {"x_G_radius", "x_radius", "tension_radius", "event_time_radius", "event_theta_radius",
           "final_tension_radius", "final_displacement_radius",
           "velocity_exact_radius"}  # fmt: skip
"""How much the solver's enclosures had grown: a radius a little wider or narrower is as true."""
TABLES = ("rearrangement_", "slip_")


@lru_cache
def honest(solver: str) -> Creep:
    cycles, tables = (9, ("rearrangements", "slip_table")) if solver == "exact" else (2, ())
    return creep(
        paper_chain(2), Cycles("0.0006", cycles), seed=5, solver=solver,
        record=("x_G", "x", "tension", "slips", "events", *tables),
    )  # fmt: skip


def passes(data: xr.Dataset) -> bool:
    """Return whether an audit of what the dataset shows finds nothing."""
    try:
        result = Creep.from_dataset(data)
    except Exception:  # `load_members` refuses such a file
        return False
    return audit_written(data, result).passed


def forged(value: Any) -> Any:
    """Return a number or word that differs: by 1e-9 relative, by one, or by a letter."""
    if isinstance(value, (bool, np.bool_)):
        return not value
    if isinstance(value, (int, np.integer)):
        return type(value)(value + 1)
    if isinstance(value, (float, np.floating)):
        return 1.0 if np.isnan(value) else value * (1 + 1e-9) if value else 1e-9
    if value.startswith("{"):
        return '{"made": "up"}'
    digits = [i for i, letter in enumerate(value) if letter in "12345678"]
    if digits:
        i = digits[0]
        return value[:i] + str(int(value[i]) + 1) + value[i + 1 :]
    return value + "x"


def forgeries(data: xr.Dataset) -> dict[str, xr.Dataset]:
    """Return a copy of the dataset for each number and word that it holds."""
    copies = {}
    for name in map(str, data.variables):
        size = data[name].size
        for place in {size - 1} if name.startswith(TABLES) else {size // 2, size - 1}:
            copy = data.copy(deep=True)
            values = copy[name].to_numpy().copy()
            wide = values.astype("U300") if values.dtype.kind == "U" else values
            flat = wide.reshape(-1)
            flat[place] = forged(flat[place].item())
            if name in copy.coords:
                copy = copy.assign_coords({name: flat})
            else:
                copy[name] = (copy[name].dims, wide.reshape(values.shape), copy[name].attrs)
            copies[f"{name}[{place}]"] = copy
    for name, value in data.attrs.items():
        copy = data.copy(deep=True)
        copy.attrs[name] = forged(value)
        copies[name] = copy
    words = {"outcome": Outcome, "evidence": Evidence}
    for name, kind in words.items():
        for word in kind:
            if word.value != data.attrs[name]:
                copy = data.copy(deep=True)
                copy.attrs[name] = word.value
                copies[f"{name}={word.value}"] = copy
    return copies


@pytest.mark.parametrize("solver", ["exact", "certified"])
def test_every_claim_of_a_file_that_is_changed_is_caught(solver: str) -> None:
    data = honest(solver).dataset
    assert passes(data)
    missed = {what.partition("[")[0] for what, copy in forgeries(data).items() if passes(copy)}
    allowed = {*CANNOT_BE_KNOWN, *MARGINS}
    assert missed <= allowed, sorted(missed - allowed)
    assert missed >= {name for name in CANNOT_BE_KNOWN if name in {*data.attrs, *data.variables}}


def test_a_forged_file_is_found_out_and_never_a_traceback(tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    data = honest("exact").dataset.copy(deep=True)
    data.attrs |= {"velocity": 99.0, "outcome": "runaway", "evidence": "proved"}
    data["x_G"] = 3 * data["x_G"]
    path.write_bytes(b"".join(netcdf({None: data})))
    told = " ".join(finding.sentence for finding in audit_file(path, most_findings=99)[0].findings)
    for word in ("x_G", "velocity", "outcome", "evidence"):
        assert word in told
    data.attrs["half_cycles"] = 100
    path.write_bytes(b"".join(netcdf({None: data})))
    with pytest.raises(InputError, match="cannot be read: it holds 18 of half_cycles = 100"):
        audit_file(path)

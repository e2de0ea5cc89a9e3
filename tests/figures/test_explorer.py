"""The explorer computes what its sliders ask for, says which law holds, and ends by counts."""

from __future__ import annotations

import math
import signal
import socket
from contextlib import suppress
from http import HTTPStatus
from itertools import product
from urllib.request import urlopen

import pytest

from exactcreep import Cycles, creep
from exactcreep.figures import explorer
from exactcreep.laws import prediction
from exactcreep.model.numbers import with_error
from tests.processes import PATIENCE, PROGRAM, begun, wait_until

START = {slider.name: slider.start for slider in explorer.SLIDERS}
START |= {"drive": "cycles", "size": explorer.START}
SIX = START | {"n": 6, "size": 1.2, "length": 10}


def test_every_edge_of_a_slider_is_in_the_model_with_friction_that_allows_it() -> None:
    for slider in explorer.SLIDERS:
        friction = {"mu_d": {"mu_s": 1.0}, "mu_s": {"mu_d": 0.0}}.get(slider.name, {})
        for edge, drive in product((slider.values[0], slider.values[-1]), explorer.DRIVES):
            values = START | friction | {slider.name: edge, "drive": drive}
            experiment = explorer.experiment_of(values)
            described = {**experiment.chain.parameters(), "seed": experiment.seed}
            described["length"] = experiment.drive.target_count / (1 + experiment.drive.cyclic)
            assert float(described[slider.name]) == edge
    assert explorer.preset_size(START, "at") == pytest.approx(1.213, abs=0.01)  # Eq. 22


def test_a_view_is_of_the_run_names_its_law_and_says_where_it_was_cut() -> None:
    whole = explorer.view_of(explorer.experiment_of(SIX))
    run = creep(whole.run.chain, whole.run.drive)
    assert (whole.run.velocity, whole.run.event_count, whole.cut) == (
        run.velocity, run.event_count, "",
    )  # fmt: skip
    assert "inside half-cycles 1 to 4" in whole.picture
    experiment = explorer.experiment_of(START | {"n": 10, "size": 10.0})
    view, run = explorer.view_of(experiment), creep(experiment.chain, Cycles("0.01", 80))
    assert f"({view.run.velocity_reason})" in view.law
    said = f"Mean velocity: {with_error(run.velocity, run.velocity_error)} g"
    assert explorer.law_sentence(run).startswith(said)
    assert f"Law that holds: {prediction(run.chain, run.drive)}." in view.law
    assert f"cut after {view.run.half_cycles} of 160 targets" in view.cut
    assert f"max_events = {explorer.MOST_EVENTS} was reached" in view.cut


@pytest.mark.parametrize("drive", explorer.DRIVES)
def test_velocities_over_the_amplitude_come_one_by_one_and_are_those_of_runs(drive: str) -> None:
    experiment = explorer.experiment_of(SIX | {"n": 2, "size": 0.5, "drive": drive})
    steps = list(explorer.velocity_points(experiment))
    known = [sum(not math.isnan(point.measured) for point in points) for points in steps]
    assert known == list(range(len(steps[0]) + 1))
    (name,) = steps[0][0].varied
    (own,) = (point for point in steps[-1] if point.varied[name] == 0.0005)
    assert own.measured == creep(experiment.chain, experiment.drive).velocity
    first, last = (explorer.velocity_picture(steps[k], experiment) for k in (0, -1))
    assert last.count("<use") > first.count("<use") + len(steps[0]) / 2
    assert ("Eq. 22" in last, "Eq. 24" in last) == (name == "amplitude", name == "sigma_theta")


@pytest.mark.usefixtures("hears_ctrl_c")
def test_the_program_ends_with_its_server() -> None:
    pytest.importorskip("marimo")
    with socket.socket() as free:  # not marimo's first: another test's server takes that
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with begun(*PROGRAM, "explore", "--headless", "--port", str(port)) as process:
        wait_until(lambda: answers(port), process)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 130
        assert not answers(port)


def answers(port: int) -> bool:
    """Return whether the page is there; the port is taken before its server is ready."""
    with suppress(OSError), urlopen(f"http://127.0.0.1:{port}/", timeout=PATIENCE) as page:
        return page.status == HTTPStatus.OK
    return False

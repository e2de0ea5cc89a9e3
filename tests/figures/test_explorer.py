"""The page to play with: what its server answers, and what it sends."""

from __future__ import annotations

import base64
import http.client
import json
import re
import signal
import socket
import struct
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from exactcreep.figures import explorer
from exactcreep.figures.animation import find_avalanche
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep import creep
from tests.conftest import Command
from tests.processes import PATIENCE, PROGRAM, begun

SMALL = {"n": "6", "amplitude": "0.0012", "sigma_mu": "0.01", "cycles": "5", "seed": "2"}


def unpacked(packed: dict[str, str]) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(packed["f4"]), "<f4")


def asked(server: tuple[str, int], path: str, **headers: str) -> tuple[int, str]:
    connection = http.client.HTTPConnection(*server, timeout=PATIENCE)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    status, text = answer.status, answer.read().decode()
    connection.close()
    return status, text


def test_the_course_is_that_of_the_run() -> None:
    experiment = explorer.experiment_of(SMALL)
    shown = explorer.course(experiment)
    record = ["x_G", "rearrangements", "slip_table"]
    run = creep(experiment.chain, experiment.drive, seed=2, record=record)
    assert f"mean velocity {run.velocity:.6g}" in shown["told"]
    assert f"{run.slip_count} slips" in shown["told"]
    beyond = explorer.experiment_of(SMALL | {"sigma_mu": "0.1", "amplitude": "0.1"})
    told = explorer.course(beyond)["told"]
    assert "max_events = 40000 was reached" in told
    assert "a static coefficient was drawn below mu_d" in told
    half_cycle, gone = run.recorded["rearrangement_half_cycle"], unpacked(shown["displacement"])
    at_ends = [gone[half_cycle <= q].sum() for q in range(1, run.half_cycles + 1)]
    assert_allclose(at_ends, run.recorded["x_G"], atol=2e-6)
    assert_array_equal(np.ceil(unpacked(shown["when"])), half_cycle)
    slips = unpacked(shown["slip"]["slider"])
    assert_array_equal(slips, run.recorded["slip_slider"])


def test_a_rearrangement_is_sent_as_its_closed_form() -> None:
    experiment = explorer.experiment_of(SMALL)
    number = 17
    found = find_avalanche(experiment, number)
    sent = explorer.avalanche(found)
    assert sent["number"] == number
    times = unpacked(sent["times"])
    for event in found.rearrangement.events:
        assert np.float32(event.time) in times
    motion = found.rearrangement.sol(times.astype(float)[3])
    moved = motion.positions - found.rearrangement.initial.displacements
    for name, values in (("moved", moved), ("velocity", motion.velocities)):
        shown = unpacked(sent[name]).reshape(-1, 6)[3]
        assert_allclose(shown, values, atol=1e-6)
    run = creep(experiment.chain, experiment.drive, seed=2, record=["rearrangements"])
    assert sent["half_cycle"] == run.recorded["rearrangement_half_cycle"][number]
    assert sent["events"] == run.recorded["rearrangement_events"][number]


def test_the_edges_of_every_slider_are_in_the_model() -> None:
    for control in explorer.CONTROLS:
        friction = {"mu_s": "1"} if control.name == "mu_d" else {}
        friction |= {"mu_d": "0"} if control.name == "mu_s" else {}
        for edge in (control.least, control.most):
            value = f"{10**edge:.3g}" if control.logarithmic else f"{edge:g}"
            explorer.experiment_of({control.name: value} | friction)


@pytest.mark.parametrize(
    ("name", "text"),
    [("n", "201"), ("n", ""), ("amplitude", "x"), ("mu_s", "0.4"), ("colour", "red")],
)
def test_bad_input_is_refused_by_the_name_of_its_field(name: str, text: str) -> None:
    with pytest.raises(InputError) as refused:
        explorer.experiment_of({name: text})
    assert refused.value.field == name


def test_a_request_for_too_much_is_refused_soon() -> None:
    with pytest.raises(InputError, match=r"was not reached: max_events = 40000 was reached"):
        explorer.answer("data", {"amplitude": "1e20", "rearrangement": "99999999"})


PAIR = "n=2&amplitude=0.0004"


@pytest.mark.parametrize(
    ("path", "status", "says"),
    [
        ("/", 200, "<figure"),
        ("/data?n=two", 400, '{"field":"n","sentence":"n = \'two\''),
        (f"/data?{PAIR}&rearrangement=99999", 400, '{"field":"rearrangement"'),
        (f"/saved?{PAIR}&rearrangement=1", 200, '"avalanche":{"number":1,'),
        ("/../pyproject.toml", 404, "no such page"),
    ],
)
def test_the_server_answers_questions_and_refuses_others(
    server: tuple[str, int], path: str, status: int, says: str
) -> None:
    answered, text = asked(server, path)
    assert (answered, says in text) == (status, True)


def test_the_server_is_for_pages_of_this_machine(server: tuple[str, int]) -> None:
    own = f"http://127.0.0.1:{server[1]}"
    assert asked(server, "/data?n=2", Origin=own)[0] == 200
    assert asked(server, "/", Host="elsewhere.example:80")[0] == 403
    for origin in ("https://elsewhere.example", "http://127.0.0.1.elsewhere.example:80", "null"):
        assert asked(server, "/data?n=2", Origin=origin)[0] == 403


def test_a_defect_is_a_sentence_and_a_visitor_that_goes_away_leaves_no_traceback(
    server: tuple[str, int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_connection(server) as visitor:
        visitor.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        visitor.sendall(b"GET /data?n=30 HTTP/1.1\r\nHost: localhost:1\r\n\r\n")
    assert asked(server, "/data?n=2")[0] == 200
    monkeypatch.setattr(explorer, "course", lambda experiment: 1 / 0)
    sentence = '{"sentence":"ZeroDivisionError: division by zero (a defect)"}'
    assert asked(server, "/data?n=2") == (500, sentence)
    assert capsys.readouterr().err == ""


def test_a_port_that_is_taken_is_refused(server: tuple[str, int], command: Command) -> None:
    refused = command("explore", "--no-browser", "--port", str(server[1]))
    assert refused.sentence.startswith(f"port = {server[1]}")


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_the_program_ends_with_its_server(number: int, status: int) -> None:
    with begun(*PROGRAM, "explore", "--no-browser") as process:
        line = process.stdout.readline()
        host, port = re.match(r"http://([\d.]+):(\d+)/ ", line).groups()
        assert asked((host, int(port)), "/", Host="elsewhere.example:80")[0] == 403
        process.send_signal(number)
        assert process.wait(PATIENCE) == status
        with pytest.raises(ConnectionRefusedError):
            asked((host, int(port)), "/")


def test_a_page_is_one_file_whatever_its_data_say() -> None:
    text = explorer.page(course={"described": "</script><script>alert(1)</script>"})
    assert text.count("</script>") == explorer.page().count("</script>")
    inside = re.search(r'id="data">(.*?)</script>', text, re.DOTALL).group(1)
    assert json.loads(inside)["course"]["described"].startswith("</script>")
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", text)

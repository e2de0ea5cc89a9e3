"""Every promise of the README and of the pages that go on with it is a test with a name."""
# ruff: noqa: E501 - a table of sentences and tests is read by lines

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests.test_readme import TOLD

ROOT = Path(__file__).parents[1]

PROMISES: dict[str, str] = {
    # the first words of a sentence of the README: the test that holds it, file::test
    "Nothing is stepped through time": "motion/test_modes.py::modal_motion_agrees_with_the_matrix_exponential",
    "Between two events": "motion/test_first_event.py::no_slider_acts_before_the_first_event",
    "A result says how well it is known": "solvers/test_evidence.py::an_avalanche_beyond_the_promise_is_undecided_alone_and_in_a_run",
    "On a machine with nothing but Python": "test_readme.py::the_readme_has_exactly_three_set_up_commands_of_one_line_each",
    "Install what the tests need": "test_readme.py::the_readme_has_exactly_three_set_up_commands_of_one_line_each",
    "Build the book": "test_book.py::a_search_finds_the_page_of_a_word",
    "Open the notebooks": "test_release.py::an_extra_that_the_readme_or_the_book_names_exists",
    "a page to play with": "figures/test_explorer.py::the_server_answers_questions_and_refuses_others",
    "a chain followed": "quasistatic/test_checkpoint.py::a_run_goes_on_from_its_checkpoint_bit_for_bit",
    "one avalanche": "figures/test_animation.py::sliders_are_drawn_as_moving_exactly_while_they_move",
    "the amplitude above": "studies/fates/test_proof.py::the_lasting_edge_of_three_sliders_is_that_of_the_horizon",
    "what becomes of it": "studies/fates/test_proof.py::a_fate_is_proved_for_ever",
    "grids of runs": "studies/test_sweep.py::a_cell_is_the_run_of_its_member",
    "the same disorder": "studies/test_compare.py::every_method_and_seed_is_the_agreement_of_its_trajectory",
    "a solid in SI units": "test_solid.py::the_roof_of_bristol_is_one_command_and_three_lines_of_python",
    "tables for pandas": "quasistatic/test_export.py::the_command_exports_what_was_saved",
    "the paper's formulas": "derivations/test_audit.py::every_entry_earns_its_verdict",
    "the figures of the paper": "figures/test_figures.py::a_picture_is_written_with_its_data_and_table",
    "`record=(": "quasistatic/test_export.py::the_tables_of_a_run_add_up_to_it",
    "To follow one avalanche": "test_book.py::the_examples_of_a_page_print_what_they_say",
    "The kernel is compiled at the first start": "commands/test_cli.py::the_kernel_is_compiled_once_and_the_first_start_says_so",
    "One avalanche, event by event": "test_readme.py::a_python_block_runs",
    "A run along a drive": "test_readme.py::a_python_block_runs",
    "Numbers given as strings": "model/test_numbers.py::a_number_is_kept_exactly",
    '`"0.6"` is 3/5': "model/test_chain.py::decimal_strings_are_kept_as_rationals",
    "Everything recorded is in": "quasistatic/test_creep.py::a_result_survives_its_file",
    "With `record=[": "quasistatic/test_export.py::the_tables_of_a_run_add_up_to_it",
    "`result.plot()` draws": "studies/test_avalanches.py::a_run_draws_itself_on_axes_that_it_is_given_or_on_new_ones",
    "`exactcreep export run.nc": "quasistatic/test_export.py::the_command_exports_what_was_saved",
    "`result.tree` has them": "quasistatic/test_export.py::a_tree_has_a_group_for_each_table_that_becomes_a_frame",
    "A scene is a TOML file": "test_readme.py::a_toml_block_is_a_scene",
    "`exactcreep scenes` lists": "commands/test_cli.py::scenes_lists_every_scene_and_shows_one",
    "`--json` prints one object": "commands/test_cli.py::json_is_one_object_with_the_numbers_of_the_run",
    "Exit status": "commands/test_cli.py::a_limit_leaves_with_status_3_and_the_partial_result",
    "A run that is killed goes on": "quasistatic/test_checkpoint.py::a_run_goes_on_from_its_checkpoint_bit_for_bit",
    "`exactcreep --help` lists": "commands/test_cli.py::every_command_has_help_with_an_example",
    "`creeping` the chain advances": "quasistatic/test_creep.py::creep_is_the_advance_of_every_slider",
    "`cycling` sliders slip": "quasistatic/test_creep.py::a_chain_on_the_level_slips_in_every_cycle_without_net_displacement",
    "`at_rest` no event": "quasistatic/test_creep.py::a_chain_below_its_threshold_is_at_rest",
    "`runaway` proved": "solvers/test_limits.py::two_sliders_above_mu_d_are_proved_to_run_away",
    "`limit` given up": "quasistatic/test_creep.py::a_limit_is_an_outcome_with_the_partial_result",
    "`proved` every comparison": "solvers/field/test_certified.py::more_precision_changes_no_proved_itinerary_and_enclosures_overlap",
    "`computed` float64": "solvers/test_evidence.py::a_run_says_from_where_on_rounding_has_grown_beyond_its_promise",
    "`undecided` some comparison": "solvers/test_evidence.py::a_run_tells_how_far_its_course_is_followed_from_what_its_velocity_is_worth",
    "Where neighbouring courses part": "studies/test_words.py::run_show_and_plan_say_alike_how_far_a_course_is_followed",
    "`velocity` is the displacement": "quasistatic/test_velocity.py::the_velocity_of_a_record_is_per_unit_of_time_however_it_is_sampled",
    "`velocity_error` is its standard error": "solvers/test_statistics.py::of_200_seeds_179_velocities_lie_within_their_interval_or_have_none",
    "Where a run leaves the model's range": "quasistatic/test_creep.py::physics_out_of_range_is_warned_of_once_and_counted",
    "`certified` decides every comparison": "solvers/field/test_certified.py::an_exact_graze_known_only_as_a_ball_is_settled_by_the_rules_and_said_to_be",
    "Its itineraries and enclosures are proved": "solvers/field/test_certified.py::enclosures_hold_the_trajectory_that_mpmath_computes_with_more_digits",
    "`exact` is float64": "motion/test_first_event.py::no_slider_acts_before_the_first_event",
    "It promises tensions to 1e-12": "extremes/test_extremes.py::no_event_is_wrong_unless_the_solver_calls_itself_undecided",
    "`rearrange` estimates the error": "solvers/exact/test_perturbed.py::an_undecided_rearrangement_is_done_again_in_balls_if_that_is_allowed",
    "The estimate is measured": "solvers/exact/test_perturbed.py::the_estimate_is_above_the_error_and_not_far_above",
    "A run is undecided from its first": "solvers/test_evidence.py::an_avalanche_beyond_the_promise_is_undecided_alone_and_in_a_run",
    "The twin goes along": "solvers/test_evidence.py::a_twin_is_followed_to_the_end_where_it_never_parts",
    "From there on the course is one of many": "solvers/test_evidence.py::other_courses_have_other_positions_and_the_same_velocity_within_their_errors",
    "`velocity_error` is a statistical estimate": "quasistatic/test_velocity.py::the_standard_error_is_the_scatter_between_seeds",
    "`python -m derivations` says": "derivations/test_audit.py::every_entry_earns_its_verdict",
    "For the right events and positions": "benchmarks/test_benchmarks.py::at_equal_accuracy_exact_is_faster_than_everything_else",
    "Per half-cycle it beats": "benchmarks/test_benchmarks.py::a_half_cycle_is_faster_than_by_verlet_at_a_hundredth",
    "For *mean velocities* alone": "benchmarks/test_benchmarks.py::a_mean_velocity_costs_no_more_than_twice_verlet_at_three_tenths",
    "`python tests/benchmarks/run.py`": "studies/test_compare.py::the_command_answers_without_options_and_its_json_holds_the_dataset",
    "`threshold`": "studies/fates/test_proof.py::the_lasting_edge_of_three_sliders_is_that_of_the_horizon",
    "`fate` follows": "studies/fates/test_proof.py::a_fate_is_proved_for_ever",
    "`compare` shows where": "studies/test_compare.py::every_method_and_seed_is_the_agreement_of_its_trajectory",
    "`audit` re-checks": "studies/test_forgery.py::a_forged_file_is_found_out_and_never_a_traceback",
    "`exactcreep.physical(...)` turns": "test_solid.py::what_few_contacts_do_is_told_from_what_friction_does",
    "`TemperatureRecord` reads": "model/test_temperature_record.py::a_packed_file_and_arrays_say_what_the_file_says",
    "Cycles and random temperatures": "test_solid.py::cycles_in_kelvin_come_down_at_the_rate_of_the_law_in_si_units",
    "In a scene, `[physical]`": "test_solid.py::the_roof_of_bristol_is_one_command_and_three_lines_of_python",
    "The chain has one temperature": "quasistatic/test_creep.py::physics_out_of_range_is_warned_of_once_and_counted",
    "Static coefficients are Gaussian": "model/test_disorder.py::drawn_coefficients_have_the_mean_and_the_width_asked_for",
    "With `dataclasses.replace(State": "quasistatic/test_creep.py::first_coefficients_hold_until_a_slider_slips_and_a_very_large_one_is_a_nail",
    "`exactcreep reproduce all": "figures/test_figures.py::a_picture_is_written_with_its_data_and_table",
    "`show` looks into": "figures/test_run_view.py::a_portrait_shows_what_a_full_record_holds",
    "`animate` moves one avalanche": "figures/test_animation.py::sliders_are_drawn_as_moving_exactly_while_they_move",
    "What `[vary]` lists": "test_scene.py::members_are_all_combinations_and_the_first_key_varies_slowest",
    "`exactcreep sweep` runs": "studies/test_sweep.py::a_cell_is_the_run_of_its_member",
    "The kernel releases Python's lock": "solvers/exact/test_exact.py::other_threads_go_on_while_the_compiled_loop_runs",
    "Every cell is saved": "studies/test_sweep.py::the_file_holds_the_grid_bit_for_bit",
    "`--plot` draws its velocities": "figures/test_draw_sweep.py::the_command_draws_its_sweep_and_refuses_before_it_runs",
    "After Ctrl-C, `kill -9`": "studies/test_sweep.py::a_sweep_that_is_killed_goes_on_where_it_was",
    "Workers need no shared disk": "studies/test_dask_cluster.py::a_killed_worker_of_a_cluster_loses_nothing",
    "A worker that dies": "studies/test_dask_cluster.py::a_killed_worker_of_a_cluster_loses_nothing",
    "From Python, `sweep(scene, executor=...)`": "studies/test_sweep.py::processes_give_the_same_bits_as_threads",
    "`exactcreep.studies.dask_cluster.cluster(address)`": "studies/test_dask_cluster.py::a_killed_worker_of_a_cluster_loses_nothing",
    "[Every module](notebooks": "test_readme.py::the_map_of_the_rooms_says_of_each_what_it_says_of_itself",
    "Data flows one way": "test_architecture.py::a_room_imports_only_from_rooms_above_it",
    "`derivations/` stands apart": "derivations/test_audit.py::derivations_import_nothing_from_the_package",
    "MIT.": "test_readme.py::licence_citation_and_ci_script_are_there",
}

NONE: dict[str, str] = {
    "The README has their map": "names a page",
    "Here is every module": "says what follows",
    "<<rooms>>": "stands for a table made from the code",
    "Exact event-driven simulation": "says what the program is",
    "The `sliding` limit is faster": "sums up the table of measurements",
    "A fixed-step integrator pays": "sums up the table of measurements",
    "What an *answer* costs": "sums up the table of measurements",
    "An avalanche is one": "says what a word means",
    "The whole table": "names a file",
    "Sliders, springs or contacts that differ": "says what is not there",
    "All sliders have the same mass": "says what is not there",
    "There is no ageing": "says what is not there",
    "To extend the model": "tells where to begin",
    "On a cluster, start": "tells what to do",
    "Under a batch system": "names another program",
}
"""Sentences that promise nothing, and why."""


def sentences() -> list[str]:
    """Return the sentences of the README, and the rows of its tables but for that of the rooms."""
    text = re.sub(r"^```.*?^```$", "", TOLD, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^\| room \|.*?\n\n", "", text, flags=re.MULTILINE | re.DOTALL)
    found: list[str] = []
    for block in re.split(r"\n\s*\n|^- ", text, flags=re.MULTILINE):
        rows = [line.strip("| ") for line in block.splitlines() if line.startswith("|")]
        rows = [" ".join(row.replace("|", " ").split()) for row in rows]
        found += rows[2:]
        prose = " ".join(block.split())
        if rows or not prose or prose.startswith(("#", "!")):
            continue
        # a sentence begins with a capital or with code; initials of names are none
        found += re.split(r"(?<!Phys\.)(?<!Rev\.)(?<=[a-z0-9\"`)*][.:;])\s+(?=[A-Z`\"])", prose)
    return found


@cache
def named_in(path: str) -> frozenset[str]:
    """Return the names of the tests in a file of this directory, without their first word."""
    tree = ast.parse((ROOT / "tests" / path).read_text(encoding="utf-8"))
    named = (node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
    return frozenset(name.removeprefix("test_") for name in named if name.startswith("test_"))


def test_every_sentence_of_the_readme_is_a_promise_with_a_test_or_says_why_it_is_none() -> None:
    told = sentences()
    assert len(told) > 60
    known = [*PROMISES, *NONE]
    open_ends = [one for one in told if not any(one.startswith(key) for key in known)]
    assert open_ends == [], "sentences without an entry above"
    gone = [key for key in known if not any(one.startswith(key) for one in told)]
    assert gone == [], "entries without a sentence"


@pytest.mark.parametrize("promise", PROMISES)
def test_a_promise_names_a_test_that_is_there(promise: str) -> None:
    path, _, name = PROMISES[promise].partition("::")
    assert name in named_in(path)

"""The explorer, an app of marimo that ``exactcreep explore`` runs; `explorer` computes for it."""

# /// script
# [tool.marimo.display]
# theme = "system"
# ///

import marimo

app = marimo.App(width="full", app_title="exactcreep: a creeping chain")

with app.setup:
    import math
    import time
    from typing import Any

    import marimo as mo

    from exactcreep.figures import explorer
    from exactcreep.model.numbers import InputError


@app.cell
def _() -> None:
    mo.md("""
    # A chain of sliders that creeps

    Its largest avalanche moves below. The first time, the solver is compiled for a minute or two.
    """)
    return


@app.cell
def _() -> Any:
    # in the cell that makes them: sliders that are shown anew lose the keyboard
    sliders = mo.ui.dictionary(
        {
            slider.name: mo.ui.slider(
                steps=list(slider.values),
                value=slider.start,
                label=slider.label,
                debounce=True,
                include_input=not slider.logarithmic,
                show_value=slider.logarithmic,
                full_width=True,
            )
            for slider in explorer.SLIDERS
        }
    )
    drive = mo.ui.radio(list(explorer.DRIVES), explorer.DRIVES[0], label="dilations", inline=True)
    preset, set_preset = mo.state(explorer.START)
    shown: dict[str, Any] = {}  # the last view that was not refused
    mo.Html(
        '<div style="display:grid;gap:2px 24px;'
        'grid-template-columns:repeat(auto-fill,minmax(min(100%,260px),1fr))">'
        f"{''.join(f'<div>{each}</div>' for each in (*sliders.values(), drive))}</div>"
    )
    return drive, preset, set_preset, shown, sliders


@app.cell
def _(preset: Any) -> Any:
    size = mo.ui.slider(
        steps=sorted({*explorer.SIZES, preset()}),
        value=preset(),
        label="1000 times the amplitude (Gaussian: times sigma_theta)",
        debounce=True,
        show_value=True,
        full_width=True,
    )
    mo.as_html(size)
    return (size,)


@app.cell
def _(drive: Any, set_preset: Any, sliders: Any) -> None:
    def preset_button(name: str) -> Any:
        wanted = explorer.preset_size({**sliders.value, "drive": drive.value}, name)
        return mo.ui.button(
            label=f"{name} the threshold",
            disabled=math.isnan(wanted),
            on_change=lambda _: set_preset(wanted),
        )

    presets = mo.ui.array([preset_button(name) for name in explorer.PRESETS])
    mo.hstack(list(presets), justify="start", wrap=True)
    return


@app.cell
def _(drive: Any, shown: dict[str, Any], size: Any, sliders: Any) -> Any:
    refused = []
    try:
        asked = explorer.experiment_of({**sliders.value, "drive": drive.value, "size": size.value})
        shown["view"] = explorer.view_of(asked)
    except InputError as error:
        told = f"{error}. Below is still the run before."
        refused = [mo.callout(mo.plain_text(told), kind="danger")]
    view = shown["view"]
    experiment = view.run.experiment
    sentences = [mo.md(each) for each in (view.law, view.fate, view.cut) if each]
    seen = mo.vstack([*sentences, mo.iframe(view.page, height="400px")])
    mo.vstack([*refused, seen.style(opacity=".45") if refused else seen])
    return (experiment,)


@app.cell
def _(experiment: Any) -> None:
    def grow() -> None:
        thread, drawn = mo.current_thread(), time.monotonic()
        points = []
        for points in explorer.velocity_points(experiment):
            if thread.should_exit:
                return
            if time.monotonic() > drawn + 1:  # a picture takes longer than most points
                mo.output.replace(mo.Html(explorer.velocity_picture(points, experiment)))
                drawn = time.monotonic()
        mo.output.replace(mo.Html(explorer.velocity_picture(points, experiment)))

    mo.Thread(target=grow).start()
    return


if __name__ == "__main__":
    app.run()

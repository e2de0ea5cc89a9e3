"""The marimo app of ``exactcreep explore``; `explorer` does the computations."""

# /// script
# [tool.marimo.display]
# theme = "system"
# ///

import marimo

app = marimo.App(width="full", app_title="exactcreep: a creeping chain")

with app.setup:
    import html
    import math
    import time
    from typing import Any

    import marimo as mo

    from exactcreep.figures import explorer
    from exactcreep.model.numbers import InputError

    def number_field(label: str, values: Any, value: float, **more: Any) -> Any:
        """Return a field for a number between the first and the last of `values`."""
        return mo.ui.number(values[0], values[-1], value=value, label=label, full_width=True,
                            debounce=True, **more)  # fmt: skip


@app.cell
def _() -> None:
    # the pictures stay in view: beside the sliders, or above them on a phone
    mo.Html("""<style>
    .seen { position: fixed; z-index: 9; display: flex; flex-direction: column; padding: 8px;
      inset: 0 0 50vh 0; background: var(--background); font-size: 14px; }
    .seen > :last-child { flex: 1; min-height: 0; }
    .seen > :last-child svg { height: 100% !important; }
    .asked { display: grid; gap: 2px 24px;
      grid-template-columns: repeat(auto-fill, minmax(min(100%, 190px), 1fr)); }
    .above { height: 53vh; }
    .seen > p { padding-right: 48px; } /* beside marimo's menu */
    @media (min-width: 800px) {
      .seen { inset: 0 0 0 48vw; } .asked, .curve { max-width: calc(48vw - 120px); }
      .above { height: 0; }
      .typed { margin-top: -24px; }
    }
    </style><div class="above"></div>""")
    return


@app.cell
def _() -> Any:
    # in the cell that makes them: sliders that are displayed again lose the keyboard
    sliders = mo.ui.dictionary(
        {
            slider.name: number_field(slider.label, slider.values, slider.start)
            if slider.logarithmic
            else mo.ui.slider(
                steps=list(slider.values),
                value=slider.start,
                label=slider.label,
                debounce=True,
                include_input=True,
                full_width=True,
            )
            for slider in explorer.SLIDERS
        }
    )
    drive = mo.ui.radio(list(explorer.DRIVES), explorer.DRIVES[0], label="dilations", inline=True)
    size, set_size = mo.state(explorer.START)
    shown: dict[str, Any] = {}  # the last valid view
    each = "".join(f"<div>{one}</div>" for one in (*sliders.values(), drive))
    mo.Html(f'<div class="asked">{each}</div>')
    return drive, set_size, shown, size, sliders


@app.cell
def _(set_size: Any, size: Any) -> None:
    chosen = mo.ui.slider(
        steps=sorted({*explorer.SIZES, size()}),
        value=size(),
        on_change=set_size,
        label="1000 times the amplitude (Gaussian: times sigma_theta)",
        debounce=True,
        full_width=True,
    )
    mo.Html(f'<div class="asked" style="display:block">{chosen}</div>')
    return


@app.cell
def _(set_size: Any, size: Any) -> None:
    # in a cell of its own: what sets the size is not displayed again, and keeps the keyboard
    typed = number_field("the same as a number", explorer.SIZES, size(), on_change=set_size)
    mo.Html(f'<div class="asked typed">{typed}</div>')
    return


@app.cell
def _(drive: Any, set_size: Any, sliders: Any) -> None:
    def preset_button(name: str) -> Any:
        wanted = explorer.preset_size({**sliders.value, "drive": drive.value}, name)
        return mo.ui.button(
            label=f"{name} the threshold",
            disabled=math.isnan(wanted),
            on_change=lambda _: set_size(wanted),
        )

    presets = mo.ui.array([preset_button(name) for name in explorer.PRESETS])
    mo.hstack(list(presets), justify="start", wrap=True)
    return


@app.cell
def _(drive: Any, shown: dict[str, Any], size: Any, sliders: Any) -> Any:
    told, faded = "", ""
    try:
        asked = explorer.experiment_of({**sliders.value, "drive": drive.value, "size": size()})
        shown["view"] = explorer.view_of(asked)
    except InputError as error:
        told = f"<b>{html.escape(str(error))}. Below is still the run before.</b>"
        faded = 'style="opacity:.45"'
    view = shown["view"]
    experiment = view.run.experiment
    said = html.escape(f"{view.law} {view.fate} {view.cut}")
    mo.Html(f'<div class="seen">{told}<p>{said}</p><div {faded}>{view.picture}</div></div>')
    return (experiment,)


@app.cell
def _(experiment: Any) -> None:
    def show(points: Any) -> None:
        drawn = explorer.velocity_picture(points, experiment)
        mo.output.replace(mo.Html(f'<div class="curve">{drawn}</div>'))

    def grow() -> None:
        thread, drawn = mo.current_thread(), time.monotonic()
        points = []
        for points in explorer.velocity_points(experiment):
            if thread.should_exit:
                return
            if time.monotonic() > drawn + 1:  # a picture takes longer than most points
                show(points)
                drawn = time.monotonic()
        show(points)

    mo.Thread(target=grow).start()
    return


if __name__ == "__main__":
    app.run()

"""Limits, signals, preparation, progress and display of a running computation.

A command or a public function sets up all of them first. None of them changes the result.

- `limits.Limits`: the events and seconds that a computation may use. A solver calls `stop` between
  two events, or `passed`.
- `preparation.clock`: the clock of limits and progress, which stands still during compilation.
- `interrupts.deferred`: a block during which Ctrl-C and SIGTERM wait. Limits check for the signal.
- `progress.Progress`: the report that every computation makes a few times a second.
- `display.Display` shows it. Public functions have the decorator `display.shows_progress`.
"""

"""Limits, signals, preparation, progress and display of a running computation.

A command or a public function sets up all of them first, before any member of a scene is made:

- `limits.Limits`: the events and seconds that it may use, handed down to the solvers. A solver
  calls `stop` between two events, or `passed`.
- `preparation.clock`: the clock of limits and progress. It stands still while solvers are compiled
  or loaded.
- `interrupts.deferred`: a block during which Ctrl-C and SIGTERM wait. Limits check for the signal,
  too, so that an interrupted computation ends like one whose time is over, with a partial result.
- `progress.Progress`: the report that every computation makes a few times a second.
- `display.Display` shows it: a bar on terminals and in notebooks, lines elsewhere. Public
  functions have the decorator `display.shows_progress`.

None of them changes the result.
"""

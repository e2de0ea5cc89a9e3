"""Work beside a running computation: limits, signals, preparation, progress, display.

A command, or a public function, begins with all of them at its first line, before any member of a
scene is made:

- `limits.Limits` are the events, and the seconds, that it may use: one value that is handed down to
  the solvers. Whoever holds it asks `stop` between two events, or `passed`.
- `preparation.clock` is the clock of limits and of progress. It stands still while solvers are
  compiled or loaded, because that comes once and is no part of the work.
- `interrupts.deferred` is a block that Ctrl-C and SIGTERM do not break. Limits look at the signal,
  too: a computation that is interrupted comes back as one whose time is over, with what it has.
- `progress.Progress` is what every computation tells about itself, a few times a second.
- `display.Display` shows it: a bar on terminals and in notebooks, lines elsewhere. The decorator
  `display.shows_progress` does so for the public functions.

Where a computation looks at them, and how often, changes no bit of its result.
"""

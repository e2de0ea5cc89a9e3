"""From unstable rest to rest: the algorithms."""

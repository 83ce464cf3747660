"""Long trials of what docs/devices.md, docs/checkpoints.md and docs/report.md tell; to be run by hand, machine idle.

    python -m tests.trials                  # all of them, one after another: half an hour
    python -m tests.trials kills launches   # some

Each is a module with `trial()`, which yields lines of its table, and does what tests do once or twice many times.
"""

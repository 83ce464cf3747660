"""Long trials behind docs/devices.md, docs/checkpoints.md and docs/report.md, run by hand on an idle machine.

    python -m tests.trials                  # all of them in sequence: half an hour
    python -m tests.trials kills launches   # some

Each is a module with `trial()`, which yields the lines of its table and repeats often what tests do once or twice.
"""

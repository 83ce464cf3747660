"""Hard geometric cases, one module each: results are checked against another method, and failures are counted."""

"""Types and limits of fields: of numbers, tuples and arrays of numbers."""

"""BSDFs that Mitsuba 3 lacks, as plugins; each module registers its own, and needs a variant that is set before."""

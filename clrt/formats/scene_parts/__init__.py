"""What the readers of Mitsuba's and pbrt's scenes share."""

"""Pictures and numbers that leave the program: image files, view transforms, comparison, reports."""

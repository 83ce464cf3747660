"""Hard cases of geometry, a file each: answers are known by another method, and what is not so is counted."""

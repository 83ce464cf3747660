"""What the paths of one pixel meet: the answer to "why is it black?"."""

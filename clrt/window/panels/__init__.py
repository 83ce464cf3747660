"""What the window shows beside the picture: a panel a file, drawn anew in every frame."""

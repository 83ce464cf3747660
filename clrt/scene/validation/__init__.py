"""What can be wrong with a scene, found before anything is compiled."""

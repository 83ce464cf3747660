"""Work on a device: bounded launches, buffers, and host memory lent to commands."""

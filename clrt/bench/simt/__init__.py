"""A model of GPUs that ranks designs: warps simulated from recorded node and triangle visits."""

"""A scene compiled for a device: packed buffers, features and program text."""

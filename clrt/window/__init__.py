"""The interactive window: a viewport on the live session, and panels that edit its scene and its settings."""

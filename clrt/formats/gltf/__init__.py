"""glTF 2.0, read, and single meshes written."""

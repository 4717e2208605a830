"""ANSYS Fluent legacy meshes and cases."""

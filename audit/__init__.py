"""Read meshes and measure them. Public names load on first use, so that importing costs nothing."""

"""Size, sign and sides of every cell, decided exactly where plain floats leave them open."""

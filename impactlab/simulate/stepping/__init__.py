"""The stepped run: from a scene to flat arrays, and the compiled loop that walks over them."""

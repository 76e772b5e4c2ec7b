"""Methods compared on a periodic and on a bouncing bar."""

"""Before the first step: a plan as the flat arrays that the loop walks over."""

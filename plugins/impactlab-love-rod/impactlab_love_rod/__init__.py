"""Rod model of impactlab: Love's rod, with the inertia of its lateral motion."""

"""The car: actuators, forces, steering and pose, as small pure functions of scalars."""

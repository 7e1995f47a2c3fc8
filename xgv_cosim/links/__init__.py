"""Links: what carries messages between a stack and a vehicle. Peers behind ``base.Link``."""

"""Vehicle profiles: the mode machines of each make. Peers behind ``base.VehicleProfile``."""

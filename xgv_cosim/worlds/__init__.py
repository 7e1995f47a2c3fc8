"""Worlds: the traffic around the bound vehicles. Peers behind ``base.World``."""

"""SUMO through libsumo: session, road, couplings and the ``World`` itself."""

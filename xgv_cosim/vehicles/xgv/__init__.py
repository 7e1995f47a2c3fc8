"""The TORC ByWire XGV: its modes, its endpoint, its error codes and its profile."""

"""Motion profiles, and the controllers that follow them with pedals and wheel (XGV-05, XGV-06)."""

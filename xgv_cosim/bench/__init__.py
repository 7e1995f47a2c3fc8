"""What binding costs: the same traffic by SUMO alone, bound, and with the bound poses merely replayed."""

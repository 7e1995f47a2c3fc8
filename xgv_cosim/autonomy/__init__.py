"""Reference stacks: autonomy that drives bound vehicles through their endpoints."""

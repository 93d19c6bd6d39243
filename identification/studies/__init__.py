"""What a model is worth: how complex it must be, how its parameters act, and what it does in a vehicle."""

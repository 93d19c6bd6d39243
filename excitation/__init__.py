"""What to play: excitation signals and test plans, as pure functions of a specification."""

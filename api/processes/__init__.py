"""Other processes of this program, which end with the process that started them."""

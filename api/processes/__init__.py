"""Other processes of this program: started, waited for, and ended with the one that started them."""

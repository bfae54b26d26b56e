"""What a user could pick instead, behind one interface: see `subject` and `registry`."""
